// Irradiance probes: directions, maps and weights. No bindings.
#ifndef TL_LIB_PROBE_GLSL
#define TL_LIB_PROBE_GLSL

#include "lib/math.glsl"
#include "lib/octahedral.glsl"
#include "lib/sampling.glsl"
#include "shared/ddgi.h"

#ifndef TL_PROBE_VOLUMES
#define TL_PROBE_VOLUMES 1 // how many there are; the first fits the scene, each of the others is finer than the one before
#endif

const float kProbeNormalBias = 0.15; // of the lookup's position, in spacings
const float kProbeViewBias = 0.05;
const float kProbeSees = 0.25;   // visibility of a surface that a probe surely sees
const float kProbeBehind = 0.02; // weight of probes behind the surface: a sheet may part them from its front
// What probes serve lies so near their grid points along all axes, in spacings: a point is served by the probes of its cell,
// and looked up somewhat above its surface.
const float kProbeVoxel = 1.0 + kProbeNormalBias + kProbeViewBias;
const float kProbeCountSettling = 2.67; // of rounds that the mean irradiance counts at most while light changes
const float kProbeReach = 0.45;     // of relocation, in steps of the grid
// Distances beyond 1.5 cell diagonals tell no lookup more: none is farther from its probe.
const float kProbeFar = 2.6; // spacings
const float kProbeNear = 0.01; // likewise nearer ones
const float kProbeVarianceFloor = 1e-3; // of their logarithms

// Node (x, y) of an octahedral map of `side` x `side` nodes, the first and last on its border.
vec3 probeNodeDirection(uint node, uint side) {
    const vec2 p = vec2(node % side, node / side) * (2.0 / float(side - 1u)) - 1.0;
    return octahedralDecode(p);
}

// Four neighbouring nodes of a map, and the place between them.
struct ProbeSquare {
    uint node; // the lower left one
    vec2 f;
};

// The square that `direction`, of any length but 0, falls into.
ProbeSquare probeSquare(vec3 direction, uint side) {
    const vec2 p = (octahedralEncode(direction) * 0.5 + 0.5) * float(side - 1u);
    const vec2 base = clamp(floor(p), vec2(0.0), vec2(side - 2u));
    return ProbeSquare(uint(base.y) * side + uint(base.x), clamp(p - base, vec2(0.0), vec2(1.0)));
}

// The node of axis +x -x +y -y +z -z in the irradiance map.
uint probeAxisNode(uint axis) {
    const uint last = kProbeIrradianceSide - 1u, middle = last / 2u;
    const uvec2 nodes[6] = {uvec2(last, middle), uvec2(0, middle),      uvec2(middle, last),
                            uvec2(middle, 0),    uvec2(middle, middle), uvec2(0, 0)};
    return nodes[axis].y * kProbeIrradianceSide + nodes[axis].x;
}

// Point i of n of the spherical Fibonacci lattice.
vec3 probeLatticeDirection(uint i, uint n) {
    return directionFromCosPhi(1.0 - (2.0 * float(i) + 1.0) / float(n), kTwoPi * fract(float(i) * 0.61803398875));
}

// A uniformly random rotation: of z to a random direction, and about it.
mat3 probeRotation(vec3 u) {
    const mat3 basis = basisAround(sampleSphere(u.xy));
    const float c = cos(kTwoPi * u.z), s = sin(kTwoPi * u.z);
    return mat3(c * basis[0] + s * basis[1], c * basis[1] - s * basis[0], basis[2]);
}

// Of distances the logarithms are averaged.
float probeLogDistance(vec3 way) { return 0.5 * log2(clamp(lengthSquared(way), sqr(kProbeNear), sqr(kProbeFar))); }

// In memory: mean and standard deviation.
uint probePackMoments(vec2 moments) {
    return packHalf2x16(vec2(moments.x, safeSqrt(moments.y - sqr(moments.x))));
}
vec2 probeMoments(uint packed) {
    const vec2 v = unpackHalf2x16(packed);
    return vec2(v.x, sqr(v.x) + sqr(v.y));
}

// cosTheta^50 without a logarithm.
float probeDistanceWeight(float cosTheta) {
    const float x2 = sqr(max(cosTheta, 0.0)), x16 = sqr(sqr(sqr(x2)));
    return sqr(x16) * x16 * x2;
}

// Share of a probe's view that reaches distance `d` where distances have these mean and mean square; one-sided Chebyshev
// bound, to the sixth power (Majercik et al. 2019, section 4: cubed). All are logarithms: along a wall at hand distances go
// from near to far within a lobe, and by their variance light would come through it.
float probeVisibility(vec2 moments, float d) {
    if (d <= moments.x) return 1.0;
    const float variance = max(abs(moments.y - sqr(moments.x)), kProbeVarianceFloor);
    const float bound = variance / (variance + sqr(d - moments.x));
    return max(sqr(bound * bound * bound), 0.05);
}

// Place in memory of the probe at coordinates `c` of the grid, along each axis.
uvec3 probeSlot(ProbeVolume volume, uvec3 c) {
#if TL_PROBE_VOLUMES > 1
    c += volume.scroll;
    return mix(c, c - volume.counts, greaterThanEqual(c, volume.counts));
#else
    return c;
#endif
}
uint probeIndex(uvec3 counts, uvec3 slot) { return slot.x + counts.x * (slot.y + counts.y * slot.z); }
uvec3 probeCoordinates(ProbeVolume volume, uint index) {
    const uvec3 counts = volume.counts;
    const uvec3 slot = uvec3(index % counts.x, index / counts.x % counts.y, index / (counts.x * counts.y));
#if TL_PROBE_VOLUMES > 1
    return mix(slot - volume.scroll, slot + counts - volume.scroll, lessThan(slot, volume.scroll));
#else
    return slot;
#endif
}

#endif
