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

// The lowest bit of a packed normal tells what is seen directly from what mirrors and glass show.
uint packNormal(vec3 normal, bool behindSpecular) {
    return (octahedralPack(normal) & ~1u) | (behindSpecular ? 1u : 0u);
}

// 1 / albedo; 0 in a channel that the surface does not reflect.
vec3 perAlbedo(vec3 albedo) {
    return vec3(safeDivide(1.0, albedo.r), safeDivide(1.0, albedo.g), safeDivide(1.0, albedo.b));
}

// Its square goes into the moments.
bool isSound(vec3 radiance) { return isFinite(radiance) && isFinite(sqr(luminance(radiance))); }

// Variance of one frame's luminance about the mean; 0 while unknown.
float frameVariance(DenoiseHistory h) {
    const float mean = luminance(h.mean);
    return h.frames > 1.0 ? max(h.squares - sqr(mean), 0.0) * h.frames / (h.frames - 1.0) : 0.0;
}

#endif
