// Adds this frame's emission to its history, which expect_emission.comp brought over where TL_EXPECTED.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseEmissionPush push; };

#include "passes/denoise/common.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    vec3 radiance = push.emission.v[index];
    if (!isSound(radiance)) {
        radiance = vec3(0.0);
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
    }
    DenoiseEmission h = DenoiseEmission(vec3(0.0), 0.0, 0.0, kEmitterNone);
#if TL_EXPECTED
    h = push.histories.v[index];
#else
    if ((push.flags & kDenoiseHistory) != 0u) h = push.previous.v[index];
#endif
    if (h.frames <= 0.0) h.mean = vec3(h.squares = 0.0); // it may not be finite
    h.frames = min(h.frames + 1.0, push.maxFrames);
    const float weight = 1.0 / max(h.frames, 1.0);
    h.mean = mix(h.mean, radiance, weight);
    h.squares = mix(h.squares, sqr(luminance(radiance)), weight);
    if (radiance != vec3(0.0)) h.light = push.emitters.v[index].light & ~kEmitterSpecular;
    push.histories.v[index] = h;
    push.emission.v[index] = h.mean;
}
