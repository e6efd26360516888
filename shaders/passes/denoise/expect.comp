// Signals' histories brought to where their surfaces are now, and how this frame differs from them.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseAccumulatePush push; };

#include "passes/denoise/past.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const float perLuminance = safeDivide(1.0, luminance(push.surfaces.v[index].albedo));
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
        const DenoiseHistory expected = expectedHistory(s, index);
        push.histories[s].v[index] = expected;
        const vec3 radiance = push.signals[s].v[index];
        vec4 difference = vec4(0.0);
        if (expected.frames > 0.0 && perLuminance > 0.0 && isSound(radiance)) {
            const float d = (luminance(radiance) - luminance(expected.mean)) * perLuminance;
            difference =
                vec4(1.0, d, sqr(d), frameVariance(expected) * (1.0 + 1.0 / expected.frames) * sqr(perLuminance));
        }
        push.differences[s].v[index] = difference;
    }
}
