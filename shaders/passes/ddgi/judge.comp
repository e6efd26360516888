// What the rays of this round tell their probes: where the probe should stand, whether it serves anybody, whether the light
// has changed, and with what weights the round enters the running means. One thread to a probe.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "lib/color.glsl"
#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#include "scene/probe_rays.glsl"
#include "scene/probes.glsl"

layout(local_size_x = 64) in;

const float kMinimumDistance = 0.06; // of a probe from what it sees, in spacings
const float kGeometryShare = 0.5;    // of the surfaces met, those met from behind, above which a probe is in geometry
// The weight of round n is kForget / (n + kForget): light of few bounces, as the first rounds saw it, is forgotten as a power
// of n, where a plain mean would keep it. The mean's variance is kForget^2 / (2 kForget - 1) / n that of one round.
const float kForget = 4.0;
const float kForgetDistance = 6.0; // likewise distances to what has moved
const float kMeanVariance = kForget * kForget / (2.0 * kForget - 1.0);
const float kFast = 0.25; // weight of a round in the fast mean
const float kCountAfterChange = 1.33;
const uint kSettle = 8u; // rounds after a change of the light for which the weight stays high, while bounces follow
const float kCountConverged = 32.0; // rounds before a probe may sleep
const float kSeenEnough = 16.0; // rounds after which distances rest until something changes

float sum(vec3 v) { return v.x + v.y + v.z; }

// What the round saw. Distances are in spacings.
struct Surroundings {
    uint hits, backs;   // surfaces met, and unlit ones met from behind
    vec4 nearestBack;   // direction and distance of the ray; w = kProbeRayMissed: none
    vec4 nearestFront;
    vec4 farthestFront; // w < 0: none
    bool litBack;
    bool nearby;
    vec3 luminance[2];  // of this round's irradiance along the axes
};

Surroundings lookAround(uint firstRay, uint rays, vec3 offset) {
    const vec4 none = vec4(0.0, 0.0, 0.0, kProbeRayMissed);
    Surroundings s = Surroundings(0u, 0u, none, none, vec4(-1.0), false, false, vec3[2](vec3(0.0), vec3(0.0)));
    vec3 weights[2] = {vec3(0.0), vec3(0.0)};
    for (uint i = 0u; i < rays; ++i) {
        const ProbeRay ray = push.rays.v[firstRay + i];
        const vec4 way = vec4(ray.direction, ray.distance);
        const vec3 reach = abs(offset + way.xyz * min(way.w, 4.0));
        s.nearby = s.nearby || maxComponent(reach) < kProbeVoxel;
        if (way.w < kProbeRayMissed) ++s.hits;
        const bool lit = (ray.flags & kProbeRayLit) != 0u;
        const bool back = (ray.flags & kProbeRayBack) != 0u;
        s.litBack = s.litBack || (back && lit);
        if (back && !lit) {
            ++s.backs;
            if (way.w < s.nearestBack.w) s.nearestBack = way;
        } else {
            if (way.w < s.nearestFront.w) s.nearestFront = way;
            if (way.w > s.farthestFront.w) s.farthestFront = way;
        }
        const vec3 up = max(way.xyz, vec3(0.0)), down = max(-way.xyz, vec3(0.0));
        weights[0] += up;
        weights[1] += down;
        s.luminance[0] += up * luminance(ray.radiance);
        s.luminance[1] += down * luminance(ray.radiance);
    }
    for (uint i = rays; i < probeRayStride(rays); ++i) {
        const ProbeRay ray = push.rays.v[firstRay + i];
        s.luminance[0] += max(ray.direction, vec3(0.0)) * luminance(ray.radiance);
        s.luminance[1] += max(-ray.direction, vec3(0.0)) * luminance(ray.radiance);
    }
    for (uint side = 0u; side < 2u; ++side) s.luminance[side] *= kPi / weights[side];
    return s;
}

// The offset that the probe should have, in spacings.
vec3 relocated(vec3 offset, vec3 reach, Surroundings s, bool inGeometry) {
    vec3 target = offset;
    if (inGeometry) {
        target += s.nearestBack.xyz * (s.nearestBack.w + 0.5 * kMinimumDistance);
    } else if (s.farthestFront.w >= 0.0) {
        const float room = s.nearestFront.w - kMinimumDistance;
        const float away = length(offset);
        if (room < 0.0) {
            const vec4 open = s.farthestFront;
            if (dot(open.xyz, s.nearestFront.xyz) <= 0.0) target += open.xyz * min(open.w, kMinimumDistance);
        } else if (away > 0.0 && room > kMinimumDistance) { // or it would come and go
            target -= offset * (min(room, away) / away);
        }
    }
    const bool worthwhile = lengthSquared(target - offset) > sqr(0.02);
    return worthwhile && all(lessThanEqual(abs(target), reach)) ? target : offset;
}

// Two-sided: the fast mean against the slow one, by the standard error of their difference. `fresh`, `slow`: luminance along
// the axes, this round's and the mean's. `part`: of a whole round's rays, which variances are told for.
bool lightChanged(inout Probe probe, float part, vec3 fresh[2], vec3 slow[2]) {
    const float fastWeight = max(kFast, 1.0 / (probe.count + 1.0));
    const float varianceWeight = max(0.1, 1.0 / max(probe.count, 1.0));
    const float errors = kFast / (2.0 - kFast) * max(probe.spared, 1.0 / part) +
                         kMeanVariance / max(probe.count, kMeanVariance) * probe.spared;
    // The axes' mean square deviation, about that of four independent ones: a chance of 0.3% after a change, when to begin
    // anew costs noise only, and of 1e-7 while nothing is known to have changed.
    const float bound = probe.watch > 0u ? 4.0 : 10.0;
    float deviation = 0.0, expected = 0.0;
    for (uint i = 0u; i < 2u; ++i) {
        // Successive differences: a step of the light enters the variance once.
        if (probe.count > 0.0)
            probe.variance[i] = mix(probe.variance[i], 0.5 * part * sqr(fresh[i] - probe.last[i]), varianceWeight);
        probe.last[i] = fresh[i];
        probe.fast[i] = mix(probe.fast[i], fresh[i], fastWeight);
        deviation += sum(sqr(probe.fast[i] - slow[i]));
        expected += sum(errors * probe.variance[i] + sqr(1e-4 * slow[i]));
    }
    return deviation > bound * expected && probe.count >= 8.0;
}

bool isConverged(Probe probe, vec3 slow[2]) {
    const float variance = max(maxComponent(probe.variance[0]), maxComponent(probe.variance[1]));
    const float brightest = max(maxComponent(slow[0]), maxComponent(slow[1]));
    return probe.count >= kCountConverged &&
           sqrt(variance * probe.spared * kMeanVariance / probe.count) <= push.tolerance * brightest;
}

vec3 meanLuminance(ProbeVolume volume, uint index, uint side) {
    vec3 result;
    for (uint axis = 0u; axis < 3u; ++axis)
        result[axis] =
            luminance(volume.irradiance.v[index * kProbeIrradianceNodes + probeAxisNode(2u * axis + side)]);
    return result;
}

// Where the probe stands and what it is good for. False: it has moved, and begins anew.
bool judgePlace(ProbeVolume volume, inout Probe probe, float part, Surroundings s) {
    const vec3 offset = probe.offset / volume.spacing;
    const float backShare = s.hits > 0u ? float(s.backs) / float(s.hits) : 0.0;
    probe.backShare = mix(probe.backShare, backShare, part / (probe.seen + part));
    if (s.litBack) probe.flags |= kProbeLitBack;
    if (s.nearby) probe.flags |= kProbeNearby;
    const bool inGeometry = probe.backShare > kGeometryShare && (probe.flags & kProbeLitBack) == 0u;

    const vec3 reach = kProbeReach * volume.steps / volume.spacing;
    // The first frame's means begin in places that stay: no rounds would follow for a probe that begins anew.
    // Nor do few rays tell one that serves a better place.
    const bool stays = (push.flags & (kProbeUpdateActive | kProbeUpdateFresh | kProbeUpdatePlaced)) != 0u ||
                       (part < 1.0 && (probe.flags & kProbeActive) != 0u);
    const bool moves = probe.moves > 0u && !stays;
    const vec3 target = moves ? relocated(offset, reach, s, inGeometry && s.backs > 0u) : offset;
    if (target != offset) {
        --probe.moves;
        probe.offset = target * volume.spacing;
        probe.flags &= kProbeNearby; // what it serves lies about its grid point
        probe.watch = max(probe.watch, 1u);
        probe.count = probe.seen = probe.backShare = 0.0;
        probe.variance[0] = probe.variance[1] = vec3(0.0);
        return false;
    }
    const bool serves = !inGeometry && (probe.flags & kProbeNearby) != 0u;
    if (serves && (probe.flags & kProbeActive) == 0u) probe.count = 0.0; // its light is that of another place or time
    probe.flags &= kProbeNearby | kProbeLitBack;
    if (serves) probe.flags |= kProbeActive;
    return true;
}

// Whether the light is another now, and whether enough of it is known. Returns the weight of this round.
float judgeLight(ProbeVolume volume, uint index, inout Probe probe, float part, vec3 fresh[2]) {
    vec3 slow[2] = fresh;
    if (probe.count > 0.0)
        for (uint side = 0u; side < 2u; ++side) slow[side] = meanLuminance(volume, index, side);
    if (lightChanged(probe, part, fresh, slow)) {
        probe.count = kCountAfterChange;
        probe.settle = kSettle;
    }
    const float weight = kForget / (probe.count + kForget);
    probe.spared = mix(probe.spared, 1.0 / part, weight);
    probe.count += 1.0;
    if (probe.settle > 0u) {
        --probe.settle;
        probe.count = min(probe.count, kProbeCountSettling);
    }
    if (isConverged(probe, slow)) probe.flags |= kProbeConverged;
    return weight;
}

void main() {
    ProbeVolume volume = push.volume.v[0];
    const bool bounce = (push.flags & kProbeUpdateBounce) != 0u;
    const bool placing = (push.flags & (kProbeUpdateRestart | kProbeUpdateMoved)) != 0u;
    const float part = float(volume.rays) / float(push.rayCount);
    const uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    const uint first = spreadGroup() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    for (uint entry = first; entry < volume.selected; entry += stride) {
        ProbeTurn turn = ProbeTurn(push.turns.v[entry].probe, 0.0, 0.0);
        Probe probe = volume.probes.v[turn.probe];
        ++probe.updates;
        const uint firstRay = entry * probeRayStride(volume.rays);
        bool stays = true;
        vec3 luminances[2] = {vec3(0.0), vec3(0.0)};
        if (!bounce) {
            if (probe.watch > 0u) --probe.watch;
            const Surroundings s = lookAround(firstRay, volume.rays, probe.offset / volume.spacing);
            luminances = s.luminance;
            stays = judgePlace(volume, probe, part, s);
            if (stays) {
                if (probe.seen < kSeenEnough)
                    turn.distanceWeight = probe.seen > 0.0 ? part * kForgetDistance / (probe.seen + kForgetDistance) : 1.0;
                probe.seen += part;
            }
        }
        if ((push.flags & kProbeUpdateTally) != 0u) {
            probe.last[0] = probe.last[1] = vec3(0.0);
            for (uint i = 0u; i < probeRayStride(volume.rays); ++i) {
                const ProbeRay ray = push.rays.v[firstRay + i];
                probe.last[0] += ray.radiance;
                probe.last[1] += ray.radiance * unpackUnorm4x8(ray.flags).yzw;
            }
        }
        if (bounce || placing) {
            probe.count = 0.0;
            turn.irradianceWeight = 1.0;
        } else if (stays) {
            turn.irradianceWeight = judgeLight(volume, turn.probe, probe, part, luminances);
        }
        volume.probes.v[turn.probe] = probe;
        push.turns.v[entry] = turn;
    }
}
