// Sums the path classes of this frame and adds them to the average. Samples that are not finite are dropped and counted.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "lib/color.glsl"
#include "lib/math.glsl"
#include "shared/passes.h"

layout(push_constant, scalar) uniform Push { CompositePush push; };

#include "scene/pass.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    vec3 color = vec3(0.0);
    for (uint i = 0u; i < push.signalCount; ++i) color += push.signals[i].v[index];
    if (!isFinite(color)) {
        color = vec3(0.0);
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
    }
    push.color.v[index] = color;

    PixelSums sums = PixelSums(vec3(0.0), vec3(0.0), 0.0);
    if (push.restart == 0u) sums = push.previous.v[index];
    // Kahan 1965. `precise` keeps the compiler from cancelling the compensation.
    precise const vec3 y = color - sums.compensation;
    precise const vec3 t = sums.sum + y;
    precise const vec3 compensation = (t - sums.sum) - y;
    sums.compensation = compensation;
    sums.sum = t;
    const float brightness = luminance(color);
    sums.squares += brightness * brightness;
    push.sums.v[index] = sums;
}
