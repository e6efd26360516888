// Surfaces compared, and radiance with albedo divided out. All comparisons are symmetric in p and q.
#ifndef TL_DENOISE_COMMON_GLSL
#define TL_DENOISE_COMMON_GLSL

#include "lib/color.glsl"
#include "lib/math.glsl"
#include "lib/octahedral.glsl"
#include "scene/pass.glsl"
#include "shared/denoise.h"

bool insideView(ivec2 pixel) {
    return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(TL_FRAME.width, TL_FRAME.height)));
}
uint pixelIndex(ivec2 pixel) { return pixelIndex(uvec2(pixel)); }

const float kNormalPower = 64.0; // half at 8 degrees
const float kOffPlane = 0.1;     // sine of the angle at which a neighbour leaves the plane

// How far p and q belong to one smooth surface, in [0, 1]. Free of scale: the offset from each other's plane counts by its
// share of their distance.
float likeness(DenoiseSurface p, DenoiseSurface q) {
    if (p.chain == kNone || q.chain == kNone || (p.chain == 0u) != (q.chain == 0u)) return 0.0;
    const vec3 np = octahedralUnpack(p.normal);
    const vec3 nq = octahedralUnpack(q.normal);
    const vec3 apart = q.position - p.position;
    const float distance2 = lengthSquared(apart);
    const float off2 = 0.5 * (sqr(dot(np, apart)) + sqr(dot(nq, apart)));
    const float share = distance2 > 0.0 ? off2 / distance2 : 0.0;
    return pow(saturate(dot(np, nq)), kNormalPower) * exp(-share / sqr(kOffPlane));
}

// radiance / albedo; 0 in a channel that the surface does not reflect.
vec3 withoutAlbedo(vec3 radiance, vec3 albedo) {
    return vec3(safeDivide(radiance.r, albedo.r), safeDivide(radiance.g, albedo.g), safeDivide(radiance.b, albedo.b));
}

// Variance of one frame's luminance about the mean; 0 while unknown.
float frameVariance(DenoiseHistory h) {
    const float mean = luminance(h.mean);
    return h.frames > 1.0 ? max(h.squares - sqr(mean), 0.0) * h.frames / (h.frames - 1.0) : 0.0;
}

#endif
