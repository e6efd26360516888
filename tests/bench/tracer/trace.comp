// Traces rays from a buffer and writes their hits.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/scene.h"

struct TraceRay {
    vec3 origin;
    float tMin;
    vec3 direction;
    float tMax;
};
struct TraceHit {
    float t;
    uint instance;
    uint primitive;
    vec2 uv;
};
TL_DECLARE_REF(TraceRay)
TL_DECLARE_REF(TraceHit)

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
    SceneTableRef scene;
    TraceRayRef rays;
    TraceHitRef hits;
    uint count;
    uint mask;
};
#define TL_SCENE scene.v[0]
#include "scene/trace.glsl"

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    const TraceRay ray = rays.v[i];
#ifdef ANY_HIT
    const bool occluded = traceAny(ray.origin, ray.direction, ray.tMin, ray.tMax, mask);
    hits.v[i] = TraceHit(ray.tMax, occluded ? 0u : kNone, 0u, vec2(0));
#else
    Hit hit;
    traceClosest(ray.origin, ray.direction, ray.tMin, ray.tMax, mask, hit);
    hits.v[i] = TraceHit(hit.t, hit.instance, hit.primitive, hit.uv);
#endif
}
