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

// How far p and q belong to one smooth surface, in [0, 1]: `power` of the cosine between normals, and the sine `slope` by
// which they leave each other's plane. Free of scale: the offset from the plane counts by its share of the distance.
float likeness(DenoiseSurface p, DenoiseSurface q, float power, float slope) {
    if (p.chain == kNone || q.chain == kNone || (p.chain == 0u) != (q.chain == 0u)) return 0.0;
    const vec3 np = octahedralUnpack(p.normal);
    const vec3 nq = octahedralUnpack(q.normal);
    const vec3 apart = q.position - p.position;
    const float distance2 = lengthSquared(apart);
    const float off2 = 0.5 * (sqr(dot(np, apart)) + sqr(dot(nq, apart)));
    const float share = distance2 > 0.0 ? off2 / distance2 : 0.0;
    return pow(saturate(dot(np, nq)), power) * exp(-share / sqr(slope));
}

// For light: half at 8 degrees.
float likeness(DenoiseSurface p, DenoiseSurface q) { return likeness(p, q, 64.0, 0.1); }
// For its changes, which are smoother: half at 32 degrees.
bool changesAlike(DenoiseSurface p, DenoiseSurface q) { return likeness(p, q, 4.0, 0.4) > 0.5; }

// radiance / albedo; 0 in a channel that the surface does not reflect.
vec3 withoutAlbedo(vec3 radiance, vec3 albedo) {
    return vec3(safeDivide(radiance.r, albedo.r), safeDivide(radiance.g, albedo.g), safeDivide(radiance.b, albedo.b));
}

// Its square goes into the moments.
bool isSound(vec3 radiance) { return isFinite(radiance) && isFinite(sqr(luminance(radiance))); }

// Variance of one frame's luminance about the mean; 0 while unknown.
float frameVariance(DenoiseHistory h) {
    const float mean = luminance(h.mean);
    return h.frames > 1.0 ? max(h.squares - sqr(mean), 0.0) * h.frames / (h.frames - 1.0) : 0.0;
}

#endif
