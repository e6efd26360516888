// Which probes this round updates: those awake take turns within the budget, and a rotating share of the sleepers. Which
// ones does not depend on the order of threads; their places in the list do, and nothing depends on those.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/pass.glsl"

layout(local_size_x = 64) in;

const uint kSentinelPeriod = 128u; // rounds between two updates of a sleeping probe
const uint kWatch = 16u;           // updates for which a change of the scene keeps probes awake
const uint kWatchFresh = 8u;       // and fresh ones
const uint kMoves = 6u;            // relocations after a change of the scene
const float kCountAfterChange = 64.0;
// When a lamp changes, all light does: means follow quickly for a while, at the price of noise.
const float kCountRelit = 3.0;
const float kSeenAfterChange = 8.0;

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
    if ((push.flags & kProbeUpdateRestart) != 0u) {
        volume.probes.v[index] = freshProbe();
    } else if ((push.flags & kProbeUpdateChanged) != 0u) {
        volume.probes.v[index].watch = kWatch;
        volume.probes.v[index].moves = kMoves;
        const bool relit = (push.flags & kProbeUpdateRelit) != 0u;
        const float limit = relit ? kCountRelit : kCountAfterChange;
        if (relit) volume.probes.v[index].settle = kWatch;
        volume.probes.v[index].count = min(volume.probes.v[index].count, limit);
        volume.probes.v[index].seen = min(volume.probes.v[index].seen, kSeenAfterChange);
        // What stood near may be gone.
        volume.probes.v[index].flags &= ~(kProbeNearby | kProbeLitBack);
    }
    const Probe probe = volume.probes.v[index];
    const bool awake = probe.watch > 0u || (probe.flags & (kProbeActive | kProbeConverged)) == kProbeActive;
    const uint period = awake ? volume.period : kSentinelPeriod;
    const bool serves = (probe.flags & kProbeActive) != 0u;
    // One out of use stays so until something changes.
    bool taken = (awake || serves) && (pcg(index) + TL_FRAME.frameIndex) % period == 0u;
    if ((push.flags & kProbeUpdateRestart) != 0u) taken = true;
    else if ((push.flags & kProbeUpdateMoved) != 0u) taken = probe.seen == 0.0;
    else if ((push.flags & (kProbeUpdateActive | kProbeUpdateBounce)) != 0u) taken = serves;
    if (awake) atomicAdd(push.volume.v[0].awake, 1u);
    if (serves) atomicAdd(TL_FRAME.counters.v[kCounterProbesActive], 1u);
    if (taken) {
        push.turns.v[atomicAdd(push.volume.v[0].selected, 1u)].probe = index;
        atomicAdd(TL_FRAME.counters.v[kCounterProbesUpdated], 1u);
    }
}
