// No splats yet.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/bpt.h"

layout(push_constant, scalar) uniform Push { BptPush push; };

#include "scene/pass.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint first = kBptSplatWords * pixelIndex(pixel);
    for (uint i = 0u; i < kBptSplatWords; ++i) push.splats.v[first + i] = 0u;
}
