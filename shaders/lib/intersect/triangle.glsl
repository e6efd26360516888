// Watertight ray-triangle intersection (Woop, Benthin, Wald 2013).
#ifndef TL_LIB_INTERSECT_TRIANGLE_GLSL
#define TL_LIB_INTERSECT_TRIANGLE_GLSL

// Maps directions to a space where the ray points along z with length 1 (section 3): rows are the sheared x, the sheared y,
// and z. The axis of largest extent becomes z, and winding is kept out of the mapping, since both sides are hit.
struct RayShear {
    vec3 x;
    vec3 y;
    vec3 z;
};

RayShear rayShear(vec3 direction) {
    const vec3 d = abs(direction);
    const bool zMajor = d.z >= d.x && d.z >= d.y;
    const bool yMajor = !zMajor && d.y >= d.x;
    // Direction with the major axis last; the basis vectors follow.
    const vec3 major = zMajor ? vec3(0, 0, 1) : yMajor ? vec3(0, 1, 0) : vec3(1, 0, 0);
    const vec3 first = zMajor ? vec3(1, 0, 0) : yMajor ? vec3(0, 0, 1) : vec3(0, 1, 0);
    const vec3 second = zMajor ? vec3(0, 1, 0) : yMajor ? vec3(1, 0, 0) : vec3(0, 0, 1);
    const vec3 permuted = zMajor ? direction.xyz : yMajor ? direction.zxy : direction.yzx;
    RayShear shear;
    shear.x = first - (permuted.x / permuted.z) * major;
    shear.y = second - (permuted.y / permuted.z) * major;
    shear.z = major / permuted.z;
    return shear;
}

// A corner relative to the ray's origin, sheared. `precise` gives a corner the same value in every triangle that shares
// it: that is what closes the edges.
vec3 shearCorner(RayShear shear, vec3 corner) {
    precise vec3 s;
    s.x = fma(shear.x.x, corner.x, fma(shear.x.y, corner.y, shear.x.z * corner.z));
    s.y = fma(shear.y.x, corner.x, fma(shear.y.y, corner.y, shear.y.z * corner.z));
    s.z = fma(shear.z.x, corner.x, fma(shear.z.y, corner.y, shear.z.z * corner.z));
    return s;
}

// a b - c d to 1.5 ulp, so with the exact result's sign: the residual of the rounded product is representable (Kahan).
float differenceOfProducts(float a, float b, float c, float d) {
    precise const float product = c * d;
    precise const float residual = fma(-c, d, product);
    precise const float difference = fma(a, b, -product);
    precise const float result = difference + residual;
    return result;
}

// Corners are relative to the ray's origin. On a hit with tMin < t < tMax sets t and the barycentrics of corners 1 and 2.
bool intersectTriangle(RayShear shear, vec3 corner0, vec3 corner1, vec3 corner2, float tMin, float tMax, out float t,
                       out vec2 uv) {
    const vec3 a = shearCorner(shear, corner0);
    const vec3 b = shearCorner(shear, corner1);
    const vec3 c = shearCorner(shear, corner2);
    // Scaled barycentrics. Their signs are exact, so a neighbour that sees an edge reversed agrees on the side, without the
    // paper's fallback to double precision; and needles keep an accurate t.
    const float u = differenceOfProducts(c.x, b.y, c.y, b.x);
    const float v = differenceOfProducts(a.x, c.y, a.y, c.x);
    const float w = differenceOfProducts(b.x, a.y, b.y, a.x);
    const float determinant = u + v + w;
    const float inverse = 1 / determinant;
    t = (u * a.z + v * b.z + w * c.z) * inverse;
    uv = vec2(v, w) * inverse;
    const bool inside = min(min(u, v), w) >= 0 || max(max(u, v), w) <= 0;
    return inside && determinant != 0 && t > tMin && t < tMax;
}

#endif
