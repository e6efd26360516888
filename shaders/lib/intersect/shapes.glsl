// Rays against the exact shapes of shared/scene.h, in local space. `direction` need not be a unit vector; t is in units of
// its length, so it is the same in world space. Each returns the nearest t with tMin < t < tMax, or tMax for none.
#ifndef TL_LIB_INTERSECT_SHAPES_GLSL
#define TL_LIB_INTERSECT_SHAPES_GLSL

#include "shared/scene.h"

// Roots of |origin + t direction| = 1 in the plane or in space, smaller one first; false when there are none. Stable for
// distant origins, where b^2 - 4ac cancels (Haines, Guenther, Akenine-Moeller, Ray Tracing Gems ch. 7): a = d.d, b = -o.d,
// and the part of o perpendicular to d.
bool unitRoots(float a, float b, float c, float perpendicularSquared, out vec2 roots) {
    const float discriminant = 1 - perpendicularSquared;
    const float q = b + (b < 0 ? -1.0 : 1.0) * sqrt(a * max(discriminant, 0));
    // The root that adds magnitudes, and the other one from the product of both.
    const float t0 = c / q, t1 = q / a;
    roots = vec2(min(t0, t1), max(t0, t1));
    return discriminant >= 0 && a > 0 && q != 0;
}

float intersectSphere(vec3 origin, vec3 direction, float tMin, float tMax) {
    const float a = dot(direction, direction);
    const float b = -dot(origin, direction);
    const vec3 perpendicular = origin + (b / a) * direction;
    vec2 roots;
    if (!unitRoots(a, b, dot(origin, origin) - 1, dot(perpendicular, perpendicular), roots)) return tMax;
    const float t = roots.x > tMin ? roots.x : roots.y;
    return t > tMin && t < tMax ? t : tMax;
}

float intersectCylinder(vec3 origin, vec3 direction, float tMin, float tMax) {
    const float a = dot(direction.yz, direction.yz);
    const float b = -dot(origin.yz, direction.yz);
    const vec2 perpendicular = origin.yz + (b / a) * direction.yz;
    vec2 roots;
    if (!unitRoots(a, b, dot(origin.yz, origin.yz) - 1, dot(perpendicular, perpendicular), roots)) return tMax;
    const bvec2 inside = lessThanEqual(abs(origin.x + roots * direction.x), vec2(0.5));
    const float t = roots.x > tMin && inside.x ? roots.x : inside.y ? roots.y : tMax;
    return t > tMin && t < tMax ? t : tMax;
}

float intersectRect(vec3 origin, vec3 direction, float tMin, float tMax) {
    const float t = -origin.z / direction.z;
    const vec2 p = abs(origin.xy + t * direction.xy);
    return t > tMin && t < tMax && max(p.x, p.y) <= 0.5 ? t : tMax;
}

float intersectDisk(vec3 origin, vec3 direction, float tMin, float tMax) {
    const float t = -origin.z / direction.z;
    const vec2 p = origin.xy + t * direction.xy;
    return t > tMin && t < tMax && dot(p, p) <= 1 ? t : tMax;
}

float intersectShape(uint shape, vec3 origin, vec3 direction, float tMin, float tMax) {
    switch (shape) {
    case kShapeSphere: return intersectSphere(origin, direction, tMin, tMax);
    case kShapeRect: return intersectRect(origin, direction, tMin, tMax);
    case kShapeDisk: return intersectDisk(origin, direction, tMin, tMax);
    case kShapeCylinder: return intersectCylinder(origin, direction, tMin, tMax);
    }
    return tMax;
}

#endif
