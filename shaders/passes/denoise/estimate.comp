// The mean radiance without albedo, and the variance of its luminance as the neighbourhood knows it: by the moments over
// time, and, while these are few, by the spread over the surface (Schied 2017, section 4.2).
#version 460
#extension GL_GOOGLE_include_directive : require

#include "passes/denoise/sum.glsl"

const float kEnoughFrames = 4.0;

void finish(uint signal, uint index, vec4 sums) {
    const DenoiseHistory own = push.histories[signal].v[index];
    float variance = safeDivide(sums.w, sums.x);
    if (own.frames < kEnoughFrames)
        variance = max(variance, safeDivide(sums.z, sums.x) - sqr(safeDivide(sums.y, sums.x)));
    push.to[signal].v[index] = vec4(own.mean * perAlbedo(push.surfaces.v[index].albedo), variance);
}
