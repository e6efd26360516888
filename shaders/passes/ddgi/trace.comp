// Rays of the selected probes: the light that the surfaces they meet scatter back. Direct light by one light sample, light of
// more bounces from the probes as the last round left them. What surfaces emit is not taken: probes hold scattered light.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#define TL_LEAST_ROUGHNESS 0.45
#define TL_PROBE_ROOTS ((push.flags & (kProbeUpdateBounce | kProbeUpdateActive | kProbeUpdateFresh)) == 0u)
#include "scene/probe_rays.glsl"
#include "scene/rough.glsl"

layout(local_size_x = 64) in;

ProbeRay traceProbeRay(vec3 origin, vec3 direction, float spacing, inout Sampler rng) {
    const RoughHit hit = traceToRough(origin, direction, 0.0, rng);
    const float distance = hit.distance < kFloatMax ? hit.distance / spacing : kProbeRayMissed;
    ProbeRay ray = ProbeRay(direction, distance, vec3(0.0), hit.back ? kProbeRayBack : 0u);
    // Probes that look for their places need to know only which backs are lit, and may not ask volumes that have not begun.
    const bool placing = (push.flags & (kProbeUpdateRestart | kProbeUpdateMoved)) != 0u;
    if (!placing) ray.radiance = hit.passed;
    if (!hit.found || (placing && !hit.back)) return ray;
    vec3 direct;
    if (placing) {
        direct = scatteredDirect(hit.shading, rng);
    } else {
        const ScatteredLight light = scatteredLight(push.volumes, push.causticCache, hit, rng);
        direct = light.direct;
        const vec3 known = hit.throughput * light.probes;
        ray.radiance += hit.throughput * (direct + light.caustic) + known;
        if ((push.flags & kProbeUpdateTally) != 0u)
            ray.flags |= packUnorm4x8(vec4(0.0, mix(known / ray.radiance, vec3(0.0), lessThanEqual(ray.radiance, vec3(0.0)))));
    }
    if (!hit.specular && maxComponent(direct) > 0.0) ray.flags |= kProbeRayLit;
    return ray;
}

void main() {
    ProbeVolume volume = push.volume.v[0];
    const uint total = volume.selected * volume.rays;
    const uint first = spreadGroup() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    for (uint i = first; i < total; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        const uint index = push.turns.v[i / volume.rays].probe;
        const uint ray = i % volume.rays;
        const Probe probe = volume.probes.v[index];
        const vec3 origin = probePosition(volume, probeCoordinates(volume, index), probe);
        const vec3 direction =
            probeRayRotation(push.firstProbe + index, probe.updates) * probeLatticeDirection(ray, volume.rays);
        Sampler rng = probeSampler(push.firstProbe + index, ray, probe.updates);
        ProbeRay result = traceProbeRay(origin, direction, volume.spacing, rng);
        if (!isFinite(result.radiance)) {
            result.radiance = vec3(0.0);
            atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
        }
        push.rays.v[i] = result;
    }
    countRays(rayCount);
}
