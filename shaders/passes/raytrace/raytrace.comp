// The paper's ray tracing: direct light at the first non-specular surface from one light sample. Path class L D S* E.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/passes.h"

layout(push_constant, scalar) uniform Push { RaytracePush push; };

#include "scene/pass.glsl"
#include "scene/shading.glsl"
#include "scene/visible_point.glsl"

layout(TL_PIXEL_GROUP) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
    vec3 direct = vec3(0.0);
    if (point.instance != kNone) {
        Sampler rng = pixelSampler(pixel);
        rng.dimension = point.dimension;
        direct = point.throughput * sampledDirectLight(shadeVisiblePoint(point), false, rng);
    }
    push.direct.v[index] = direct;
    countRays(rayCount);
}
