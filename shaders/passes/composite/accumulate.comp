// Adds the planes of one AOV to their running sum; samples that are not finite count as 0.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "lib/math.glsl"
#include "shared/passes.h"

layout(push_constant, scalar) uniform Push { AccumulatePush push; };

#include "scene/pass.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint first = pixelIndex(pixel) * push.channels;
    for (uint i = first; i < first + push.channels; ++i) {
        float value = 0.0;
        for (uint k = 0u; k < push.valueCount; ++k) value += push.values[k].v[i];
        const float sum = push.restart == 0u ? push.previous.v[i] : 0.0;
        push.sum.v[i] = isFinite(value) ? sum + value : sum;
    }
}
