// The rays of this round enter the probes' means with the weights that judge.comp found. One workgroup to a probe: every
// lane loads a ray and tells it to its subgroup, so that nodes read rays from registers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/probe_rays.glsl"
#include "scene/probes.glsl"

layout(local_size_x = 64) in;

// Ray i of the `count` of a probe, whose first is `first`; beyond the last, one that counts for nothing.
ProbeRay loadRay(uint first, uint i, uint count) {
    if (i < count) return push.rays.v[first + i];
    return ProbeRay(vec3(0.0), 0.0, vec3(0.0), 0u);
}

void blendIrradiance(ProbeVolume volume, ProbeTurn turn, uint firstRay) {
    for (uint first = gl_SubgroupID * gl_SubgroupSize; first < kProbeIrradianceNodes; first += gl_WorkGroupSize.x) {
        const uint i = first + gl_SubgroupInvocationID;
        const vec3 normal = probeNodeDirection(i, kProbeIrradianceSide);
        vec4 sum = vec4(0.0); // of radiance and 1, each times the cosine
        for (uint base = 0u; base < volume.rays; base += gl_SubgroupSize) {
            const ProbeRay own = loadRay(firstRay, base + gl_SubgroupInvocationID, volume.rays);
            for (uint lane = 0u; lane < gl_SubgroupSize; ++lane) {
                const vec3 direction = subgroupBroadcast(own.direction, lane);
                const vec3 radiance = subgroupBroadcast(own.radiance, lane);
                sum += max(dot(normal, direction), 0.0) * vec4(radiance, 1.0);
            }
        }
        for (uint ray = volume.rays; ray < probeRayStride(volume.rays); ++ray) {
            const ProbeRay photon = push.rays.v[firstRay + ray];
            sum.rgb += max(dot(normal, photon.direction), 0.0) * photon.radiance;
        }
        if (i >= kProbeIrradianceNodes) continue;
        const uint node = turn.probe * kProbeIrradianceNodes + i;
        const vec3 fresh = sum.rgb * (kPi / sum.w);
        volume.irradiance.v[node] =
            turn.irradianceWeight < 1.0 ? mix(volume.irradiance.v[node], fresh, turn.irradianceWeight) : fresh;
    }
}

void blendDistances(ProbeVolume volume, ProbeTurn turn, uint firstRay) {
    const uint stride = gl_WorkGroupSize.x;
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    vec3 axes[kProbeDistanceNodes / stride];
    vec3 sums[kProbeDistanceNodes / stride]; // of the logarithm of distance, its square, and weights
    for (uint k = 0u; k < axes.length(); ++k) {
        axes[k] = probeNodeDirection(thread + k * stride, kProbeDistanceSide);
        sums[k] = vec3(0.0);
    }
    for (uint base = 0u; base < volume.rays; base += gl_SubgroupSize) {
        const ProbeRay own = loadRay(firstRay, base + gl_SubgroupInvocationID, volume.rays);
        const float ownDistance = log2(clamp(own.distance, kProbeNear, kProbeFar));
        for (uint lane = 0u; lane < gl_SubgroupSize; ++lane) {
            const vec3 direction = subgroupBroadcast(own.direction, lane);
            const float d = subgroupBroadcast(ownDistance, lane);
            for (uint k = 0u; k < axes.length(); ++k)
                sums[k] += probeDistanceWeight(dot(axes[k], direction)) * vec3(d, d * d, 1.0);
        }
    }
    for (uint k = 0u; k < axes.length(); ++k) {
        const uint node = turn.probe * kProbeDistanceNodes + thread + k * stride;
        const vec2 fresh = sums[k].xy / max(sums[k].z, 1e-30);
        const vec2 moments = turn.distanceWeight < 1.0
                                 ? mix(probeMoments(volume.distances.v[node]), fresh, turn.distanceWeight)
                                 : fresh;
        volume.distances.v[node] = probePackMoments(moments);
    }
}

void main() {
    ProbeVolume volume = push.volume.v[0];
    for (uint entry = spreadGroup(); entry < volume.selected; entry += gl_NumWorkGroups.x) {
        const ProbeTurn turn = push.turns.v[entry];
        const uint firstRay = entry * probeRayStride(volume.rays);
        if (turn.irradianceWeight > 0.0) blendIrradiance(volume, turn, firstRay);
        if (turn.distanceWeight > 0.0) blendDistances(volume, turn, firstRay);
    }
}
