// The mean radiance without albedo, and the variance of its luminance as the neighbourhood knows it: by the moments over
// time, and, while these are few, by the spread over the surface (Schied 2017, section 4.2).
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseEstimatePush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float kEnoughFrames = 4.0;

// Weighted sums over the neighbourhood.
struct Spread {
    float weight, value, square;
    float timeWeight, timeVariance;
};

void gather(inout Spread s, DenoiseHistory h, float weight, float albedo) {
    const float value = luminance(h.mean) / albedo;
    s.weight += weight;
    s.value += weight * value;
    s.square += weight * sqr(value);
    if (h.frames > 1.0) {
        s.timeWeight += weight;
        s.timeVariance += weight * frameVariance(h) / (h.frames * sqr(albedo));
    }
}

float varianceOf(Spread s, float frames) {
    const float variance = safeDivide(s.timeVariance, s.timeWeight);
    if (frames >= kEnoughFrames) return variance;
    const float mean = safeDivide(s.value, s.weight);
    return max(variance, max(safeDivide(s.square, s.weight) - sqr(mean), 0.0));
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const DenoiseSurface p = push.surfaces.v[index];

    Spread spreads[TL_SIGNALS];
    [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k) spreads[k] = Spread(0.0, 0.0, 0.0, 0.0, 0.0);
    for (int i = 0; i < 25; ++i) {
        const ivec2 tap = ivec2(pixel) + ivec2(i % 5 - 2, i / 5 - 2);
        if (!insideView(tap)) continue;
        const uint tapIndex = pixelIndex(tap);
        const DenoiseSurface q = push.surfaces.v[tapIndex];
        const float weight = likeness(p, q);
        const float albedo = luminance(q.albedo);
        if (!(weight > 0.0) || !(albedo > 0.0)) continue;
        [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k) gather(spreads[k], push.histories[k].v[tapIndex], weight, albedo);
    }
    [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k) {
        const DenoiseHistory own = push.histories[k].v[index];
        push.estimates[k].v[index] = vec4(withoutAlbedo(own.mean, p.albedo), varianceOf(spreads[k], own.frames));
    }
}
