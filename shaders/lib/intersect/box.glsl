// Whether triangles and shapes reach into a box that was turned into their local space: a parallelepiped. False only where
// they do not; true where a few separating directions do not tell.
#ifndef TL_LIB_INTERSECT_BOX_GLSL
#define TL_LIB_INTERSECT_BOX_GLSL

#include "shared/scene.h"

struct Parallelepiped {
    vec3 center;
    mat3 edges;  // half of each, as columns
    vec3 extent; // half the size of the box with sides along the axes that encloses it
};

Parallelepiped parallelepiped(vec3 center, mat3 edges) {
    return Parallelepiped(center, edges, abs(edges[0]) + abs(edges[1]) + abs(edges[2]));
}

// The box in a space that `m` leads to.
Parallelepiped transformed(mat4x3 m, Parallelepiped box) {
    return parallelepiped(m * vec4(box.center, 1), mat3(m) * box.edges);
}

bool mayMeetTriangle(Parallelepiped box, vec3 corner0, vec3 corner1, vec3 corner2) {
    const vec3 low = min(min(corner0, corner1), corner2) - box.center;
    const vec3 high = max(max(corner0, corner1), corner2) - box.center;
    if (any(greaterThan(low, box.extent)) || any(lessThan(high, -box.extent))) return false;
    const vec3 normal = cross(corner1 - corner0, corner2 - corner0);
    const vec3 reach = abs(normal * box.edges);
    return abs(dot(normal, corner0 - box.center)) <= reach.x + reach.y + reach.z;
}

bool mayMeetShape(Parallelepiped box, uint shape) {
    const vec3 size = shape == kShapeSphere     ? vec3(1)
                      : shape == kShapeCylinder ? vec3(0.5, 1, 1)
                      : shape == kShapeDisk     ? vec3(1, 1, 0)
                                                : vec3(0.5, 0.5, 0);
    if (any(greaterThan(abs(box.center), size + box.extent))) return false;
    // Spheres are hollow.
    return shape != kShapeSphere || !(abs(length(box.center) - 1) > length(box.extent));
}

#endif
