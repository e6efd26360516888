// Which probes this round updates: those awake take turns within the budget, and a rotating share of the sleepers. Which
// ones does not depend on the order of threads; their places in the list do, and nothing depends on those.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/pass.glsl"

layout(local_size_x = 64) in;

const uint kSentinelPeriod = 128u; // rounds between two updates of a sleeping probe, at least
const uint kSentinels = 32u;       // that are updated in a round, on average, at most

void main() {
    const uint index = gl_GlobalInvocationID.x;
    ProbeVolume volume = push.volume.v[0];
    if (index >= volume.probeCount) return;
    const Probe probe = volume.probes.v[index];
    const bool awake = probe.watch > 0u || (probe.flags & (kProbeActive | kProbeConverged)) == kProbeActive;
    const bool serves = (probe.flags & kProbeActive) != 0u;
    const bool idle = !serves && probe.seen > 0.0;
    const uint period = awake ? (idle ? 2u : 1u) * volume.period : max(kSentinelPeriod, volume.probeCount / kSentinels);
    // One out of use stays so until something changes.
    bool taken = (awake || serves) && (pcg(index) + volume.round) % period == 0u;
    if ((push.flags & (kProbeUpdateRestart | kProbeUpdateMoved)) != 0u)
        taken = (probe.flags & kProbeEmpty) == 0u && probe.seen == 0.0;
    else if ((push.flags & kProbeUpdateFresh) != 0u) taken = serves && probe.count < 2.0;
    else if ((push.flags & (kProbeUpdateActive | kProbeUpdateBounce)) != 0u) taken = serves;
    const uint halves = subgroupAdd(awake ? (idle ? 1u : 2u) : 0u), serving = subgroupAdd(serves ? 1u : 0u);
    if (subgroupElect()) {
        atomicAdd(push.volume.v[0].awake, halves);
        atomicAdd(push.volume.v[0].serving, serving);
    }
    if (taken) {
        push.turns.v[atomicAdd(push.volume.v[0].selected, 1u)].probe = index;
        atomicAdd(TL_FRAME.counters.v[kCounterProbesUpdated], 1u);
    }
}
