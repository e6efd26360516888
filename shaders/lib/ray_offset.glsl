// Origins of rays that leave a surface, on the right side of it in spite of rounding.
#ifndef TL_LIB_RAY_OFFSET_GLSL
#define TL_LIB_RAY_OFFSET_GLSL

// Moves `position` off its surface along the unit vector `side`, towards where the ray goes. Waechter and Binder (Ray
// Tracing Gems ch. 6) offset by ulps of each coordinate and by a constant near 0, which ties the constant to scenes of
// metres, and leaves a surface through x = 0 too little where its y is large. Here every bound is relative, so the same
// rule holds at any scale. With u = 2^-24, P the largest coordinate and `extent` the size of the primitive (or, where they
// are larger, of the local coordinates before translation), in world units:
//   interpolating the corners and transforming the point   <= 4 u extent + 5 u (3 extent + P)
//   rounding of this sum                                   <= u P
//   transforming the origin into local space               <= 6 u 3 (P + extent)
//   corners relative to the origin, shear, distance        <= 6 u extent
// together below 43 u (P + extent), and 64 u is taken.
vec3 offsetRayOrigin(vec3 position, vec3 side, float extent) {
    const vec3 p = abs(position);
    const float magnitude = max(max(p.x, p.y), p.z) + extent;
    return position + side * (magnitude * 3.814697265625e-6); // 64 * 2^-24
}

#endif
