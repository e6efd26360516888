// What a restart, or a change of the scene, does to all probes, and what a volume's motion to those that it comes to. Those with nothing in their voxels, as far as can be told
// without rays, take no part until the next change.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "lib/probe.glsl"
#include "scene/bindings.glsl"
#include "scene/box_query.glsl"

layout(local_size_x = 64) in;

const uint kWatch = 16u;     // updates for which a change of the scene keeps probes awake
const uint kWatchFresh = 8u; // and fresh ones
const uint kMoves = 6u;      // relocations after a change of the scene
const float kCountAfterMotion = 43.0;
const float kSeenAfterChange = 8.0; // updates, of as many rays as they have now

Probe freshProbe() {
    Probe p;
    p.offset = vec3(0.0);
    p.flags = p.updates = p.settle = 0u;
    p.count = p.seen = p.backShare = 0.0;
    p.spared = 1.0;
    p.watch = kWatchFresh;
    p.moves = kMoves;
    for (uint i = 0u; i < 2u; ++i) p.fast[i] = p.last[i] = p.variance[i] = vec3(0.0);
    return p;
}

void main() {
    const uint index = gl_GlobalInvocationID.x;
    ProbeVolume volume = push.volume.v[0];
    if (index >= volume.probeCount) return;
    const uvec3 coordinates = probeCoordinates(volume, index);
    const bool scrolled = (push.flags & kProbeUpdateScrolled) != 0u;
    const ivec3 before = ivec3(coordinates) + push.shift;
    // It was part of the volume before.
    if (scrolled && all(greaterThanEqual(before, ivec3(0))) && all(lessThan(before, ivec3(volume.counts)))) return;
    const bool begins = scrolled || (push.flags & kProbeUpdateRestart) != 0u;
    const vec3 place = volume.origin + vec3(coordinates) * volume.steps;
    const bool empty = boxIsEmpty(place, vec3(kProbeVoxel * volume.spacing), kMaskIndirect);
    // What was empty until now has known nothing for long.
    if (begins || empty || (volume.probes.v[index].flags & kProbeEmpty) != 0u) {
        Probe probe = freshProbe();
        if (empty) {
            probe.flags = kProbeEmpty;
            probe.watch = 0u;
        }
        volume.probes.v[index] = probe;
        return;
    }
    volume.probes.v[index].watch = kWatch;
    volume.probes.v[index].moves = kMoves;
    const bool relit = (push.flags & kProbeUpdateRelit) != 0u;
    // When a lamp changes, all light does: means follow quickly for a while, at the price of noise.
    const float limit = relit ? kProbeCountSettling : kCountAfterMotion;
    if (relit) volume.probes.v[index].settle = kWatch;
    volume.probes.v[index].count = min(volume.probes.v[index].count, limit);
    const float part = float(volume.rays) / float(push.rayCount);
    volume.probes.v[index].seen = min(volume.probes.v[index].seen, part * kSeenAfterChange);
    // What they belonged to may be gone. Where boxes cannot be asked, only a round of all rays is sure to see it again.
    volume.probes.v[index].flags &= ~kProbeLitBack;
    if (!kBoxesAnswer && part == 1.0) volume.probes.v[index].flags &= ~kProbeNearby;
}
