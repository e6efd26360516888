// Irradiance by interpolation between probes; see plugins/ddgi/README.md. Any pass that has read `ddgi.volumes` may call it,
// and is compiled with TL_PROBE_VOLUMES as it is there, the parameter `ddgi.volumes`.
#ifndef TL_SCENE_PROBES_GLSL
#define TL_SCENE_PROBES_GLSL

#include "lib/probe.glsl"

// Tells the frame's statistics of the volumes.
void countProbes(ProbeVolumeRef volumes) {
    uint probes = 0u, serving = 0u;
    for (uint k = 0u; k < TL_PROBE_VOLUMES; ++k) {
        probes += volumes.v[k].probeCount;
        serving += volumes.v[k].serving;
    }
    TL_FRAME.counters.v[kCounterProbes] = probes;
    TL_FRAME.counters.v[kCounterProbesActive] = serving;
}

vec3 probeMapIrradiance(ProbeVolume volume, uint probe, ProbeSquare square) {
    const uint node = probe * kProbeIrradianceNodes + square.node, above = node + kProbeIrradianceSide;
    const vec3 low = mix(volume.irradiance.v[node], volume.irradiance.v[node + 1u], square.f.x);
    return mix(low, mix(volume.irradiance.v[above], volume.irradiance.v[above + 1u], square.f.x), square.f.y);
}

// Mean and mean square of log2 of spacings. `direction` of any length but 0.
vec2 probeMapDistance(ProbeVolume volume, uint probe, vec3 direction) {
    const ProbeSquare square = probeSquare(direction, kProbeDistanceSide);
    const uint node = probe * kProbeDistanceNodes + square.node, above = node + kProbeDistanceSide;
    const vec2 low = mix(probeMoments(volume.distances.v[node]), probeMoments(volume.distances.v[node + 1u]), square.f.x);
    const vec2 high =
        mix(probeMoments(volume.distances.v[above]), probeMoments(volume.distances.v[above + 1u]), square.f.x);
    return mix(low, high, square.f.y);
}

vec3 probePosition(ProbeVolume volume, uvec3 coordinates, Probe probe) {
    return volume.origin + vec3(coordinates) * volume.steps + probe.offset;
}

// Share of a corner of a cell: along each axis linear between where it and its neighbour stand, which need not be where the
// grid has them.
float probeShare(vec3 x, vec3 own, vec3 others) {
    const vec3 apart = own - others;
    vec3 share = (x - others) / apart;
    share = mix(share, vec3(0.5), equal(apart, vec3(0.0)));
    share = clamp(share, vec3(0.001), vec3(1.0));
    return share.x * share.y * share.z;
}

// Irradiance falls with the square of the distance from what it comes from, a convex function, which a chord overestimates; its
// root is nearer to a line. But a mean of roots takes noise for darkness, which bounces multiply: while probes know little,
// they ask each other for irradiance itself (TL_PROBE_ROOTS, an expression of the pass).
#ifndef TL_PROBE_ROOTS
#define TL_PROBE_ROOTS true
#endif
vec3 probeToBlend(vec3 irradiance) { return TL_PROBE_ROOTS ? sqrt(irradiance) : irradiance; }
vec3 probeFromBlend(vec3 blended) { return TL_PROBE_ROOTS ? sqr(blended) : blended; }

// Sum of the square roots of the irradiance of the probes of the cell that holds `place`, each times its weight; w: of weights.
// See below. All places in spacings, from the volume's origin.
vec4 probeCellIrradiance(ProbeVolume volume, vec3 place, vec3 position, vec3 biased, vec3 geometricNormal,
                         ProbeSquare square, bool back) {
    const vec3 steps = volume.steps / volume.spacing;
    const uvec3 base = uvec3(clamp(place / steps, vec3(0.0), vec3(volume.counts) - 2.0));
    const uvec3 slots[2] = {probeSlot(volume, base), probeSlot(volume, base + 1u)};
    uint indices[8];
    vec3 positions[8];
    uint serving = 0u;
    [[unroll]] for (uint corner = 0u; corner < 8u; ++corner) {
        const uvec3 side = uvec3(corner, corner >> 1, corner >> 2) & 1u;
        indices[corner] = probeIndex(volume.counts, uvec3(slots[side.x].x, slots[side.y].y, slots[side.z].z));
        const Probe probe = volume.probes.v[indices[corner]];
        positions[corner] = vec3(base + side) * steps + probe.offset / volume.spacing;
        if ((probe.flags & kProbeActive) != 0u) serving |= 1u << corner;
    }
    vec4 sum = vec4(0.0);
    [[unroll]] for (uint corner = 0u; corner < 8u; ++corner) {
        if ((serving >> corner & 1u) == 0u) continue;
        const uint index = indices[corner];
        const vec3 center = positions[corner];
        const vec3 others = vec3(positions[corner ^ 1u].x, positions[corner ^ 2u].y, positions[corner ^ 4u].z);
        const vec3 toProbe = center - position;
        const float facing = dot(toProbe, geometricNormal) * inversesqrt(max(lengthSquared(toProbe), 1e-12));
        const float before = smoothstep(0.0, 0.05, facing); // the surface, or in its plane
        float weight = (sqr(0.5 * facing + 0.5) + 0.2) * mix(kProbeBehind, 1.0, before);
        const vec3 fromProbe = biased - center;
        const vec3 direction = fromProbe == vec3(0.0) ? geometricNormal : fromProbe;
        const float visibility = probeVisibility(probeMapDistance(volume, index, direction), probeLogDistance(fromProbe));
        if (back) weight *= smoothstep(0.5 * kProbeSees, 1.5 * kProbeSees, visibility) * before;
        weight *= visibility;
        if (weight < 0.2) weight *= sqr(weight) / 0.04;
        weight *= probeShare(place, center, others);
        sum += weight * vec4(probeToBlend(probeMapIrradiance(volume, index, square)), 1.0);
    }
    return sum;
}

// Irradiance as probeIrradiance tells it, from one volume; w: whether it knows any.
vec4 probeVolumeIrradiance(ProbeVolume volume, vec3 position, vec3 geometricNormal, ProbeSquare square, vec3 wo, bool back) {
    const vec3 x = (position - volume.origin) / volume.spacing;
    const vec3 biased = x + kProbeNormalBias * geometricNormal + kProbeViewBias * wo;
    vec4 sum = vec4(0.0);
    for (uint cell = 0u; cell < 2u && sum.w == 0.0; ++cell)
        sum = probeCellIrradiance(volume, x + float(cell) * geometricNormal, x, biased, geometricNormal, square, back);
    return sum.w > 0.0 ? vec4(probeFromBlend(sum.rgb / sum.w), 1.0) : vec4(0.0);
}

// Falls from 1 to 0 within the outermost cells of a volume.
float probeVolumeShare(ProbeVolume volume, vec3 position) {
    const vec3 x = (position - volume.origin) / volume.steps;
    const vec3 inside = min(x, vec3(volume.counts) - 1.0 - x);
    return clamp(min(inside.x, min(inside.y, inside.z)), 0.0, 1.0);
}

// Irradiance, W/m^2, on a surface with shading normal `normal` on the side of unit `wo`: light that at least one surface has
// scattered. `geometricNormal` is on the same side. Probes count by distance, by whether they lie before the surface, and
// by whether they see it (Majercik et al. 2019, section 5); where none of the cell serves, those of the next cell along the
// normal do. Their square roots are interpolated: irradiance falls with the square of the distance from what it comes from,
// a convex function, which a chord overestimates; its root is nearer to a line. Of several volumes the finest that knows the
// point counts, and less so in its outermost cells. `back`: of the back of a surface, where only probes count that surely
// see it: the inside of things is dark.
vec3 probeIrradiance(ProbeVolumeRef volumes, vec3 position, vec3 geometricNormal, vec3 normal, vec3 wo, bool back) {
    const ProbeSquare square = probeSquare(normal, kProbeIrradianceSide);
    vec4 sum = vec4(0.0);
    for (uint k = TL_PROBE_VOLUMES - 1u; k > 0u; --k) {
        ProbeVolume volume = volumes.v[k];
        const float share = (1.0 - sum.w) * probeVolumeShare(volume, position);
        if (share > 0.0) sum += share * probeVolumeIrradiance(volume, position, geometricNormal, square, wo, back);
    }
    if (sum.w < 1.0) {
        ProbeVolume volume = volumes.v[0];
        sum += (1.0 - sum.w) * probeVolumeIrradiance(volume, position, geometricNormal, square, wo, back);
    }
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0);
}

#endif
