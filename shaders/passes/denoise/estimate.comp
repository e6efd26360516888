// The mean radiance without albedo, and the variance of its luminance as the neighbourhood knows it: by the moments over
// time, and, while these are few, by the spread over the surface (Schied 2017, section 4.2).
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseEstimatePush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float kEnoughFrames = 4.0;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const DenoiseSurface p = push.surfaces.v[index];
    const DenoiseHistory own = push.history.v[index];

    float weights = 0.0;
    float sum = 0.0;
    float squares = 0.0;
    float timeWeights = 0.0;
    float timeVariance = 0.0;
    for (int i = 0; i < 25; ++i) {
        const ivec2 tap = ivec2(pixel) + ivec2(i % 5 - 2, i / 5 - 2);
        if (!insideView(tap)) continue;
        const uint tapIndex = pixelIndex(tap);
        const DenoiseSurface q = push.surfaces.v[tapIndex];
        const float weight = likeness(p, q);
        const float albedo = luminance(q.albedo);
        if (!(weight > 0.0) || !(albedo > 0.0)) continue;
        const DenoiseHistory h = push.history.v[tapIndex];
        const float value = luminance(h.mean) / albedo;
        weights += weight;
        sum += weight * value;
        squares += weight * sqr(value);
        if (h.frames > 1.0) {
            timeWeights += weight;
            timeVariance += weight * frameVariance(h) / (h.frames * sqr(albedo));
        }
    }
    float variance = safeDivide(timeVariance, timeWeights);
    if (own.frames < kEnoughFrames) {
        const float mean = safeDivide(sum, weights);
        variance = max(variance, max(safeDivide(squares, weights) - sqr(mean), 0.0));
    }
    push.estimate.v[index] = vec4(withoutAlbedo(own.mean, p.albedo), variance);
}
