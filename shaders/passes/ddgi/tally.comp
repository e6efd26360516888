// How much of the probes' light is still missing after a few bounces. Of what their rays see, T, the part A comes from what
// probes had told in the round before, in which rays saw T'. As r = A / T' of all light returns from each bounce, T ends at
// (T - A) / (1 - r), channel by channel (a geometric series, Lyusternik's acceleration). One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/bindings.glsl"

layout(local_size_x = 64) in;

const float kMostReturned = 0.95; // of light, by a bounce

shared vec3 seen[gl_WorkGroupSize.x], known[gl_WorkGroupSize.x];

void main() {
    ProbeVolume volume = push.volume.v[0];
    const uint thread = gl_LocalInvocationID.x;
    seen[thread] = known[thread] = vec3(0.0);
    // By probe, not by place in the list of turns: sums in any order would round differently.
    for (uint i = thread; i < volume.probeCount; i += gl_WorkGroupSize.x) {
        const Probe probe = volume.probes.v[i];
        if ((probe.flags & kProbeActive) == 0u) continue;
        seen[thread] += probe.last[0];
        known[thread] += probe.last[1];
    }
    barrier();
    if (thread != 0u) return;
    vec3 all = vec3(0.0), returned = vec3(0.0);
    for (uint i = 0u; i < gl_WorkGroupSize.x; ++i) {
        all += seen[i];
        returned += known[i];
    }
    const vec3 before = volume.seen;
    const vec3 share = min(mix(returned / before, vec3(0.0), lessThanEqual(before, vec3(0.0))), vec3(kMostReturned));
    const vec3 growth = (all - returned) / ((1.0 - share) * all);
    push.volume.v[0].growth = mix(vec3(1.0), growth, greaterThan(all, vec3(0.0)));
    push.volume.v[0].seen = all;
}
