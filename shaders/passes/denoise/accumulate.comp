// Adds this frame's sample to the history. One that is not finite counts as 0, as in composite.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseAccumulatePush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    vec3 radiance = push.signal.v[index];
    if (!isSound(radiance)) {
        radiance = vec3(0.0);
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
    }
    DenoiseHistory h = push.history.v[index];
    h.frames = min(h.frames + 1.0, push.maxFrames);
    h.mean = mix(h.mean, radiance, 1.0 / h.frames);
    h.squares = mix(h.squares, sqr(luminance(radiance)), 1.0 / h.frames);
    push.history.v[index] = h;
}
