// Irradiance by interpolation between probes; see plugins/ddgi/README.md. Any pass that has read `ddgi.volume` may call it.
#ifndef TL_SCENE_PROBES_GLSL
#define TL_SCENE_PROBES_GLSL

#include "lib/probe.glsl"

vec3 probeMapIrradiance(ProbeVolume volume, uint probe, vec3 direction) {
    vec2 f;
    const uint node = probe * kProbeIrradianceNodes + probeSquare(direction, kProbeIrradianceSide, f);
    const vec3 low = mix(volume.irradiance.v[node], volume.irradiance.v[node + 1u], f.x);
    const uint above = node + kProbeIrradianceSide;
    return mix(low, mix(volume.irradiance.v[above], volume.irradiance.v[above + 1u], f.x), f.y);
}

vec2 probeMapDistance(ProbeVolume volume, uint probe, vec3 direction) {
    vec2 f;
    const uint node = probe * kProbeDistanceNodes + probeSquare(direction, kProbeDistanceSide, f);
    const vec2 low = mix(volume.distances.v[node], volume.distances.v[node + 1u], f.x);
    const uint above = node + kProbeDistanceSide;
    return mix(low, mix(volume.distances.v[above], volume.distances.v[above + 1u], f.x), f.y);
}

vec3 probePosition(ProbeVolume volume, uvec3 coordinates, Probe probe) {
    return volume.origin + vec3(coordinates) * volume.steps + probe.offset;
}

// Share of a corner of a cell: along each axis linear between where it and its neighbour stand, which need not be where the
// grid has them.
vec3 probeShare(vec3 positions[8], uint corner, vec3 x) {
    vec3 share;
    for (uint axis = 0u; axis < 3u; ++axis) {
        const float own = positions[corner][axis], other = positions[corner ^ 1u << axis][axis];
        share[axis] = own == other ? 0.5 : (x[axis] - other) / (own - other);
    }
    return clamp(share, vec3(0.001), vec3(1.0));
}

// Sum of the irradiance of the probes of the cell that holds `place`, each times its weight; w: of weights. See below.
vec4 probeCellIrradiance(ProbeVolume volume, vec3 place, vec3 position, vec3 biased, vec3 geometricNormal, vec3 normal,
                         uint required) {
    const uvec3 base = uvec3(clamp((place - volume.origin) / volume.steps, vec3(0.0), vec3(volume.counts) - 2.0));
    const uint first = probeIndex(volume.counts, base);
    const uvec3 strides = uvec3(1u, volume.counts.x, volume.counts.x * volume.counts.y);
    vec3 positions[8];
    uint serving = 0u;
    for (uint corner = 0u; corner < 8u; ++corner) {
        const uvec3 side = uvec3(corner, corner >> 1, corner >> 2) & 1u;
        const Probe probe = volume.probes.v[first + side.x * strides.x + side.y * strides.y + side.z * strides.z];
        positions[corner] = probePosition(volume, base + side, probe);
        if ((probe.flags & required) == required) serving |= 1u << corner;
    }
    vec4 sum = vec4(0.0);
    for (uint corner = 0u; corner < 8u; ++corner) {
        if ((serving >> corner & 1u) == 0u) continue;
        const uvec3 side = uvec3(corner, corner >> 1, corner >> 2) & 1u;
        const uint index = first + side.x * strides.x + side.y * strides.y + side.z * strides.z;
        const vec3 center = positions[corner];
        float weight = sqr(0.5 * dot(safeNormalize(center - position, normal), geometricNormal) + 0.5) + 0.2;
        const vec3 fromProbe = (biased - center) / volume.spacing;
        const vec2 moments = probeMapDistance(volume, index, safeNormalize(fromProbe, -normal));
        weight *= probeVisibility(moments, length(fromProbe));
        if (weight < 0.2) weight *= sqr(weight) / 0.04;
        const vec3 share = probeShare(positions, corner, place);
        weight *= share.x * share.y * share.z;
        sum += weight * vec4(probeMapIrradiance(volume, index, normal), 1.0);
    }
    return sum;
}

// Irradiance, W/m^2, on a surface with shading normal `normal` on the side of unit `wo`: light that at least one surface has
// scattered. `geometricNormal` is on the same side. Probes count by distance, by whether they lie before the surface, and
// by whether they see it (Majercik et al. 2019, section 5); where none of the cell serves, those of the next cell along the
// normal do. `back`: of the back of a surface, which probes know only if they have seen lit ones: the inside of things is
// dark.
vec3 probeIrradiance(ProbeVolumeRef reference, vec3 position, vec3 geometricNormal, vec3 normal, vec3 wo, bool back) {
    ProbeVolume volume = reference.v[0];
    const vec3 biased = position + volume.spacing * (kProbeNormalBias * geometricNormal + kProbeViewBias * wo);
    const uint required = back ? kProbeActive | kProbeLitBack : kProbeActive;
    vec4 sum = vec4(0.0);
    for (uint cell = 0u; cell < 2u && sum.w == 0.0; ++cell)
        sum = probeCellIrradiance(volume, position + float(cell) * volume.spacing * geometricNormal, position, biased,
                                  geometricNormal, normal, required);
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0);
}

#endif
