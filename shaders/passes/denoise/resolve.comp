// Puts albedo back. A channel without albedo keeps the history's mean: there was nothing to divide by.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseResolvePush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const vec3 albedo = push.surfaces.v[index].albedo;
    const vec3 mean = push.history.v[index].mean;
    vec3 radiance = albedo * push.estimate.v[index].rgb;
    for (int i = 0; i < 3; ++i)
        if (!(albedo[i] > 0.0)) radiance[i] = mean[i];
    push.signal.v[index] = radiance;
}
