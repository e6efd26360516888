// A signal's history brought to where its surfaces are now: what this frame should look like if nothing changed.
#ifndef TL_DENOISE_PAST_GLSL
#define TL_DENOISE_PAST_GLSL

#include "passes/denoise/common.glsl"

DenoiseHistory expectedHistory(uint signal, uint index) {
    DenoiseHistory expected = DenoiseHistory(vec3(0.0), 0.0, 0.0);
    if ((push.flags & kDenoiseHistory << signal) == 0u) return expected;
    if ((push.flags & kDenoiseStill) != 0u) return push.previous[signal].v[index];
    const DenoiseReprojection r = push.reprojection.v[index];
    if (r.weights == 0u) return expected;
    vec4 weights = unpackUnorm4x8(r.weights);
    weights /= dot(weights, vec4(1.0));
    const ivec2 corner = ivec2(r.corner & 0xffffu, r.corner >> 16) - 1;
    for (int i = 0; i < 4; ++i) {
        if (weights[i] == 0.0) continue;
        const DenoiseHistory then = push.previous[signal].v[pixelIndex(corner + ivec2(i & 1, i >> 1))];
        expected.mean += weights[i] * then.mean;
        expected.squares += weights[i] * then.squares;
        expected.frames += weights[i] * then.frames;
    }
    const float before = luminance(expected.mean);
    expected.mean *= r.gain;
    expected.squares *= sqr(safeDivide(luminance(expected.mean), before));
    return expected;
}

#endif
