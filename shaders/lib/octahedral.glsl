// Unit vectors in the octahedral map: Meyer et al. 2010; Cigolle et al. 2014.
#ifndef TL_LIB_OCTAHEDRAL_GLSL
#define TL_LIB_OCTAHEDRAL_GLSL

vec2 octahedralFold(vec2 p) { return (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0); }

// Vector of any length but 0 to [-1, 1]^2.
vec2 octahedralEncode(vec3 n) {
    const vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return n.z >= 0.0 ? p : octahedralFold(p);
}

vec3 octahedralDecode(vec2 p) {
    const float z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3(z >= 0.0 ? p : octahedralFold(p), z));
}

// 2 x 16 bits: within 7e-5 radians. The signed-normalised centre is exact, so the axes survive the round trip.
uint octahedralPack(vec3 n) { return packSnorm2x16(octahedralEncode(n)); }
vec3 octahedralUnpack(uint bits) { return octahedralDecode(unpackSnorm2x16(bits)); }

#endif
