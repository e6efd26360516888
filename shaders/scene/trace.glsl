// Rays against the scene: one interface, two tracers. The pass defines TL_SCENE, an expression of type SceneTable, before
// it includes this; TL_TRACER_QUERY selects VK_KHR_ray_query instead of our own BVH. Both give the same hits to within
// rounding.
#ifndef TL_SCENE_TRACE_GLSL
#define TL_SCENE_TRACE_GLSL

#include "shared/scene.h"

struct Hit {
    float t;         // in units of the direction's length
    uint instance;
    uint primitive;  // triangle in mesh order; shapes: 0
    vec2 uv;         // barycentrics of corners 1 and 2; shapes: 0
};

// bool traceClosest(vec3 origin, vec3 direction, float tMin, float tMax, uint mask, out Hit hit)
//   The nearest hit with tMin < t < tMax among instances whose mask shares a bit with `mask`.
// bool traceAny(vec3 origin, vec3 direction, float tMin, float tMax, uint mask)
//   Whether there is one.
// Directions need not be unit vectors. Rays with a zero or non-finite direction or origin hit nothing.

bool rayIsValid(vec3 origin, vec3 direction, float tMin, float tMax) {
    const float longest = max(max(abs(direction.x), abs(direction.y)), abs(direction.z));
    const float sum = dot(abs(origin) + abs(direction), vec3(1)); // not finite where an operand is not
    return longest > 0 && sum <= 3.4e38 && tMin < tMax;
}

#ifdef TL_TRACER_QUERY
#include "scene/trace_query.glsl"
#else
#include "scene/trace_compute.glsl"
#endif

#endif
