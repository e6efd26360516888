// Adds this frame's samples to the histories, which expect.comp brought over where TL_EXPECTED.
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
    uint unsound = 0u;
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
        vec3 radiance = push.signals[s].v[index];
        if (!isSound(radiance)) {
            radiance = vec3(0.0);
            ++unsound;
        }
#if TL_EXPECTED
        DenoiseHistory h = push.histories[s].v[index];
#else
        DenoiseHistory h = expectedHistory(s, index);
#endif
        h.frames = min(h.frames + 1.0, push.maxFrames);
        h.mean = mix(h.mean, radiance, 1.0 / h.frames);
        h.squares = mix(h.squares, sqr(luminance(radiance)), 1.0 / h.frames);
        push.histories[s].v[index] = h;
        if ((push.flags & kDenoiseUnfiltered) != 0u) push.signals[s].v[index] = h.mean;
    }
    if (unsound > 0u) atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], unsound);
}
