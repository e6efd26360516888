// What the rays of this round tell their probes: where the probe should stand, whether it serves anybody, whether the light
// has changed, and with what weight the round enters the running means. One workgroup to a probe.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "lib/color.glsl"
#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/probe_rays.glsl"
#include "scene/probes.glsl"

layout(local_size_x = 64) in;

const uint kMaxRays = 256u;
const float kMissed = 1e30; // distance of a ray that met nothing, in spacings
const float kMinimumDistance = 0.06; // of a probe from what it sees, in spacings
const float kGeometryShare = 0.25;   // of the surfaces met, those met from behind, above which a probe is in geometry
// The weight of round n is kForget / (n + kForget): light of few bounces, as the first rounds saw it, is forgotten as a power
// of n, where a plain mean would keep it; so are distances to what has moved. The mean's variance is
// kForget^2 / (2 kForget - 1) / n that of one round.
const float kForget = 6.0;
const float kMeanVariance = kForget * kForget / (2.0 * kForget - 1.0);
const float kFast = 0.25; // weight of a round in the fast mean
const float kCountAfterChange = 2.0;
const uint kSettle = 8u; // rounds after a change of the light for which the weight stays high, while bounces follow
const float kCountConverged = 32.0; // rounds before a probe may sleep
const float kSeenEnough = 32.0; // rounds after which distances rest until something changes

shared vec3 directions[kMaxRays];
shared vec3 radiance[kMaxRays];
shared float distances[kMaxRays]; // in spacings
shared uint rayFlags[kMaxRays];
shared float axisLuminance[kProbeAxes];
shared float irradianceWeight, distanceWeight; // of this round

vec3 roundIrradiance(vec3 normal) {
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (uint i = 0u; i < push.raysPerProbe; ++i) {
        const float cosTheta = max(dot(normal, directions[i]), 0.0);
        sum += cosTheta * radiance[i];
        weights += cosTheta;
    }
    return sum * (kPi / weights);
}

// Four nodes for each thread, so that rays are read once for all of them.
void blendDistances(ProbeVolume volume, uint index) {
    const uint stride = gl_WorkGroupSize.x;
    vec3 axes[kProbeDistanceNodes / stride];
    vec3 sums[kProbeDistanceNodes / stride]; // of distance, its square, and weights
    for (uint k = 0u; k < axes.length(); ++k) {
        axes[k] = probeNodeDirection(gl_LocalInvocationID.x + k * stride, kProbeDistanceSide);
        sums[k] = vec3(0.0);
    }
    for (uint i = 0u; i < push.raysPerProbe; ++i) {
        const vec3 direction = directions[i];
        const float d = min(distances[i], kProbeFar);
        for (uint k = 0u; k < axes.length(); ++k)
            sums[k] += probeDistanceWeight(dot(axes[k], direction)) * vec3(d, d * d, 1.0);
    }
    for (uint k = 0u; k < axes.length(); ++k) {
        const uint node = index * kProbeDistanceNodes + gl_LocalInvocationID.x + k * stride;
        const vec2 value = sums[k].xy / max(sums[k].z, 1e-30);
        volume.distances.v[node] =
            distanceWeight < 1.0 ? mix(volume.distances.v[node], value, distanceWeight) : value;
    }
}

// What the round saw of the geometry, distances in spacings.
struct Surroundings {
    float backShare;
    uint nearestBack, nearestFront, farthestFront; // rays; raysPerProbe: none
    bool litBack;
    bool nearby;
};

Surroundings lookAround(vec3 offset) {
    const uint none = push.raysPerProbe;
    Surroundings s = Surroundings(0.0, none, none, none, false, false);
    uint backs = 0u, hits = 0u;
    for (uint i = 0u; i < push.raysPerProbe; ++i) {
        const float d = distances[i];
        // A point is served by the probes of its cell, and looked up somewhat above its surface.
        const vec3 reach = abs(offset + directions[i] * min(d, 4.0));
        s.nearby = s.nearby || maxComponent(reach) < 1.0 + kProbeNormalBias + kProbeViewBias;
        if (d < kMissed) ++hits;
        const bool lit = (rayFlags[i] & kProbeRayLit) != 0u;
        const bool back = (rayFlags[i] & kProbeRayBack) != 0u;
        s.litBack = s.litBack || (back && lit);
        if (back && !lit) {
            ++backs;
            if (s.nearestBack == none || d < distances[s.nearestBack]) s.nearestBack = i;
        } else {
            if (s.nearestFront == none || d < distances[s.nearestFront]) s.nearestFront = i;
            if (s.farthestFront == none || d > distances[s.farthestFront]) s.farthestFront = i;
        }
    }
    s.backShare = hits > 0u ? float(backs) / float(hits) : 0.0;
    return s;
}

// The offset that the probe should have, in spacings.
vec3 relocated(vec3 offset, vec3 reach, Surroundings s, bool inGeometry) {
    vec3 target = offset;
    if (inGeometry) {
        target += directions[s.nearestBack] * (distances[s.nearestBack] + 0.5 * kMinimumDistance);
    } else if (s.nearestFront < push.raysPerProbe) {
        const float room = distances[s.nearestFront] - kMinimumDistance;
        const float away = length(offset);
        if (room < 0.0) {
            const vec3 open = directions[s.farthestFront];
            if (dot(open, directions[s.nearestFront]) <= 0.0)
                target += open * min(distances[s.farthestFront], kMinimumDistance);
        } else if (away > 0.0) {
            target -= offset * (min(room, away) / away);
        }
    }
    const bool worthwhile = lengthSquared(target - offset) > sqr(0.02);
    return worthwhile && all(lessThanEqual(abs(target), reach)) ? target : offset;
}

// Two-sided: the fast mean against the slow one, by the standard error of their difference. `slow`: luminance along the axes.
bool lightChanged(inout Probe probe, float slow[kProbeAxes]) {
    const float fastWeight = max(kFast, 1.0 / (probe.count + 1.0));
    const float varianceWeight = max(0.1, 1.0 / max(probe.count, 1.0));
    const float errors = kFast / (2.0 - kFast) + kMeanVariance / max(probe.count, kMeanVariance);
    // The axes' mean square deviation, about that of four independent ones: a chance of 0.3% after a change, when to begin
    // anew costs noise only, and of 1e-7 while nothing is known to have changed.
    const float bound = probe.watch > 0u ? 4.0 : 10.0;
    float deviation = 0.0, expected = 0.0;
    for (uint i = 0u; i < kProbeAxes; ++i) {
        const float value = axisLuminance[i];
        // Successive differences: a step of the light enters the variance once.
        if (probe.count > 0.0)
            probe.variance[i] = mix(probe.variance[i], 0.5 * sqr(value - probe.last[i]), varianceWeight);
        probe.last[i] = value;
        probe.fast[i] = mix(probe.fast[i], value, fastWeight);
        deviation += sqr(probe.fast[i] - slow[i]);
        expected += errors * probe.variance[i] + sqr(1e-4 * slow[i]);
    }
    return deviation > bound * expected && probe.count >= 8.0;
}

bool isConverged(Probe probe, float slow[kProbeAxes]) {
    float variance = 0.0, brightest = 0.0;
    for (uint i = 0u; i < kProbeAxes; ++i) {
        variance = max(variance, probe.variance[i]);
        brightest = max(brightest, slow[i]);
    }
    return probe.count >= kCountConverged &&
           sqrt(variance * kMeanVariance / probe.count) <= push.tolerance * brightest;
}

// Thread 0: the probe's own state after this round.
void updateProbe(ProbeVolume volume, uint index) {
    if ((push.flags & kProbeUpdateBounce) != 0u) {
        ++volume.probes.v[index].updates;
        volume.probes.v[index].count = 0.0;
        irradianceWeight = 1.0;
        distanceWeight = 0.0;
        return;
    }
    Probe probe = volume.probes.v[index];
    ++probe.updates;
    if (probe.watch > 0u) --probe.watch;
    const vec3 offset = probe.offset / volume.spacing;
    const Surroundings s = lookAround(offset);
    probe.backShare = mix(probe.backShare, s.backShare, 1.0 / (probe.seen + 1.0));
    if (s.litBack) probe.flags |= kProbeLitBack;
    if (s.nearby) probe.flags |= kProbeNearby;
    const bool inGeometry = probe.backShare > kGeometryShare && (probe.flags & kProbeLitBack) == 0u;

    irradianceWeight = distanceWeight = 0.0;
    const vec3 reach = kProbeReach * volume.steps / volume.spacing;
    const vec3 target = probe.moves > 0u ? relocated(offset, reach, s, inGeometry && s.backShare > 0.0) : offset;
    if (target != offset) {
        --probe.moves;
        probe.offset = target * volume.spacing;
        probe.flags = 0u;
        probe.count = probe.seen = probe.backShare = 0.0;
        for (uint i = 0u; i < kProbeAxes; ++i) probe.variance[i] = 0.0;
    } else {
        float slow[kProbeAxes];
        for (uint i = 0u; i < kProbeAxes; ++i)
            slow[i] = probe.count > 0.0
                          ? luminance(volume.irradiance.v[index * kProbeIrradianceNodes + probeAxisNode(i)])
                          : axisLuminance[i];
        if (lightChanged(probe, slow)) {
            probe.count = kCountAfterChange;
            probe.settle = kSettle;
        }
        irradianceWeight = kForget / (probe.count + kForget);
        distanceWeight = probe.seen < kSeenEnough ? kForget / (probe.seen + kForget) : 0.0;
        if (probe.settle > 0u) --probe.settle;
        else probe.count += 1.0;
        probe.seen += 1.0;
        const bool serves = !inGeometry && (probe.flags & kProbeNearby) != 0u;
        probe.flags &= kProbeNearby | kProbeLitBack;
        if (serves) probe.flags |= kProbeActive;
        if (isConverged(probe, slow)) probe.flags |= kProbeConverged;
    }
    volume.probes.v[index] = probe;
}

void main() {
    if (TL_FRAME.width == 0u) return;
    ProbeVolume volume = push.volume.v[0];
    const uint thread = gl_LocalInvocationID.x;
    for (uint entry = gl_WorkGroupID.x; entry < volume.selected; entry += push.groups) {
        const uint index = push.list.v[entry];
        const mat3 rotation = probeRayRotation(index, volume.probes.v[index].updates);
        for (uint i = thread; i < push.raysPerProbe; i += gl_WorkGroupSize.x) {
            const ProbeRay ray = push.rays.v[entry * push.raysPerProbe + i];
            directions[i] = rotation * probeLatticeDirection(i, push.raysPerProbe);
            radiance[i] = ray.radiance;
            distances[i] = ray.distance < kFloatMax ? ray.distance / volume.spacing : kMissed;
            rayFlags[i] = ray.flags;
        }
        barrier();
        vec3 fresh[2];
        for (uint i = thread, k = 0u; i < kProbeIrradianceNodes; i += gl_WorkGroupSize.x, ++k) {
            fresh[k] = roundIrradiance(probeNodeDirection(i, kProbeIrradianceSide));
            for (uint axis = 0u; axis < kProbeAxes; ++axis)
                if (probeAxisNode(axis) == i) axisLuminance[axis] = luminance(fresh[k]);
        }
        barrier();
        if (thread == 0u) updateProbe(volume, index);
        barrier();
        if (irradianceWeight > 0.0)
            for (uint i = thread, k = 0u; i < kProbeIrradianceNodes; i += gl_WorkGroupSize.x, ++k) {
                const uint node = index * kProbeIrradianceNodes + i;
                volume.irradiance.v[node] =
                    irradianceWeight < 1.0 ? mix(volume.irradiance.v[node], fresh[k], irradianceWeight) : fresh[k];
            }
        if (distanceWeight > 0.0) blendDistances(volume, index);
        barrier();
    }
}
