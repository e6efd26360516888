// Constants and small functions that every shader may use. Nothing in lib/ has bindings.
#ifndef TL_LIB_MATH_GLSL
#define TL_LIB_MATH_GLSL

const float kPi = 3.14159265358979;
const float kTwoPi = 6.28318530717959;
const float kInvPi = 0.318309886183791;
const float kInvTwoPi = 0.159154943091895;
const float kInvFourPi = 0.0795774715459477;
const float kFloatMax = 3.402823466e38;
const float kOneMinusEpsilon = 0.99999994; // the largest float below 1

float sqr(float x) { return x * x; }
vec3 sqr(vec3 x) { return x * x; }
float pow5(float x) { return sqr(sqr(x)) * x; }
float safeSqrt(float x) { return sqrt(max(x, 0.0)); }
float saturate(float x) { return clamp(x, 0.0, 1.0); }
vec3 saturate(vec3 x) { return clamp(x, vec3(0.0), vec3(1.0)); }
float maxComponent(vec3 v) { return max(v.x, max(v.y, v.z)); }
float minComponent(vec3 v) { return min(v.x, min(v.y, v.z)); }
float lengthSquared(vec3 v) { return dot(v, v); }

// Bit tests: isnan and isinf may be folded away by compilers that assume finite arithmetic.
bool isFinite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }
bool isFinite(vec2 v) { return isFinite(v.x) && isFinite(v.y); }
bool isFinite(vec3 v) { return isFinite(v.x) && isFinite(v.y) && isFinite(v.z); }
bool isFinite(vec4 v) { return isFinite(v.xy) && isFinite(v.zw); }

// a / b, and 0 where b is 0 or the quotient overflows.
float safeDivide(float a, float b) {
    const float q = a / b;
    return b != 0.0 && isFinite(q) ? q : 0.0;
}

vec3 safeNormalize(vec3 v, vec3 otherwise) {
    const float scale = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (!(scale > 0.0) || !isFinite(v)) return otherwise;
    return normalize(v / scale); // no underflow of the squares
}

// Orthonormal basis around unit n; columns tangent, bitangent, n: world = basis * local, local = world * basis.
// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
mat3 basisAround(vec3 n) {
    const float s = n.z >= 0.0 ? 1.0 : -1.0;
    const float a = -1.0 / (s + n.z);
    const float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

#endif
