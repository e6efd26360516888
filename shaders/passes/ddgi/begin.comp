// One round of probe updates begins: the volume's description, and how many of its probes take part.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeBeginPush push; };

#include "scene/bindings.glsl"

layout(local_size_x = 1) in;

void main() {
    ProbeVolume volume;
    volume.probes = push.probes;
    volume.irradiance = push.irradiance;
    volume.distances = push.distances;
    volume.origin = push.origin;
    volume.spacing = push.spacing;
    volume.steps = push.steps;
    volume.counts = push.counts;
    volume.scroll = push.scroll;
    volume.probeCount = push.counts.x * push.counts.y * push.counts.z;
    volume.selected = 0u;
    const uint awake = push.waking != 0u ? volume.probeCount : (push.volume.v[0].awake + 1u) / 2u;
    volume.awake = volume.serving = 0u;
    volume.round = push.waking != 0u ? 0u : push.volume.v[0].round + (push.budget > 0u ? 1u : 0u);
    volume.rays = push.rays;
    volume.period = 1u;
    if (push.budget > 0u) {
        // All probes often with few rays follow the light better than some of them with many.
        volume.rays = clamp(push.budget / max(awake, 1u) & ~3u, push.fewest, push.rays);
        volume.period = max((awake * volume.rays + push.budget - 1u) / push.budget, 1u);
    }
    volume.seen = push.volume.v[0].seen;
    volume.growth = push.volume.v[0].growth;
    push.volume.v[0] = volume;
}
