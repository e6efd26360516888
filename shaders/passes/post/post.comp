// The averaged picture as a display shows it: exposure, tone map, sRGB encoding, 8 bits.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/display.h"
#include "shared/passes.h"

layout(push_constant, scalar) uniform Push { PostPush push; };

#include "scene/pass.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const vec3 mean = push.sums.v[index].sum / float(push.frames);
    const vec3 display = displayFromScene(mean, push.exposure, push.tonemap);
    push.display.v[index] = packUnorm4x8(vec4(display, 1.0));
}
