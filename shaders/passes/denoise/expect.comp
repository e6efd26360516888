// A signal's history brought to where its surfaces are now: what this frame should look like if nothing changed; and how it
// differs from that.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseExpectPush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const DenoiseReprojection r = push.reprojection.v[index];
    DenoiseHistory expected = DenoiseHistory(vec3(0.0), 0.0, 0.0);
    vec4 weights = unpackUnorm4x8(r.weights);
    if ((push.flags & kDenoiseHistory) != 0u && r.weights != 0u) {
        weights /= dot(weights, vec4(1.0));
        const ivec2 corner = ivec2(r.corner & 0xffffu, r.corner >> 16) - 1;
        for (int i = 0; i < 4; ++i) {
            if (weights[i] == 0.0) continue;
            const DenoiseHistory then = push.previous.v[pixelIndex(corner + ivec2(i & 1, i >> 1))];
            expected.mean += weights[i] * then.mean;
            expected.squares += weights[i] * then.squares;
            expected.frames += weights[i] * then.frames;
        }
        const float before = luminance(expected.mean);
        expected.mean *= r.gain;
        expected.squares *= sqr(safeDivide(luminance(expected.mean), before));
    }
    push.history.v[index] = expected;

    vec4 difference = vec4(0.0);
    const float albedo = luminance(push.surfaces.v[index].albedo);
    const vec3 radiance = push.signal.v[index];
    if (expected.frames > 0.0 && albedo > 0.0 && isSound(radiance)) {
        const float d = (luminance(radiance) - luminance(expected.mean)) / albedo;
        difference = vec4(1.0, d, sqr(d), frameVariance(expected) * (1.0 + 1.0 / expected.frames) / sqr(albedo));
    }
    push.difference.v[index] = difference;
}
