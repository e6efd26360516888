// What a restart, or a change of the scene, does to all probes. Those with nothing in their voxels, as far as can be told
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
const float kCountAfterChange = 64.0;
// When a lamp changes, all light does: means follow quickly, at the price of noise; the more so where it was at rest before,
// and where probes wait long for their turns.
const float kCountRelit = 12.0;
const float kCountSudden = 3.0;
const uint kSettleSudden = 6u;
const float kSeenAfterChange = 2.0;

Probe freshProbe() {
    Probe p;
    p.offset = vec3(0.0);
    p.flags = p.updates = p.settle = 0u;
    p.count = p.seen = p.backShare = 0.0;
    p.watch = kWatchFresh;
    p.moves = kMoves;
    for (uint i = 0u; i < 2u; ++i) p.fast[i] = p.last[i] = p.variance[i] = vec3(0.0);
    return p;
}

void main() {
    const uint index = gl_GlobalInvocationID.x;
    ProbeVolume volume = push.volume.v[0];
    if (index >= volume.probeCount) return;
    const bool restart = (push.flags & kProbeUpdateRestart) != 0u;
    const vec3 place = volume.origin + vec3(probeCoordinates(volume.counts, index)) * volume.steps;
    const bool empty = boxIsEmpty(place, vec3(kProbeVoxel * volume.spacing), kMaskIndirect);
    // What was empty until now has known nothing for long.
    if (restart || empty || (volume.probes.v[index].flags & kProbeEmpty) != 0u) {
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
    const bool sudden = (push.flags & kProbeUpdateSudden) != 0u;
    float limit = kCountAfterChange;
    if (relit) limit = sudden ? kCountSudden : max(kCountRelit / float(volume.period), kCountSudden);
    if (sudden) volume.probes.v[index].settle = kSettleSudden;
    volume.probes.v[index].count = min(volume.probes.v[index].count, limit);
    volume.probes.v[index].seen = min(volume.probes.v[index].seen, kSeenAfterChange);
    volume.probes.v[index].flags &= ~kProbeLitBack; // what it belonged to may be gone
}
