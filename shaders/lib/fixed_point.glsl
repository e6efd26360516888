// Sums that don't depend on the order of their terms: 64-bit fixed point in two words, added by 32-bit atomics, which
// every device has. Terms are not negative and in a unit that the caller derives from the scene; the quantum is 2^-36 of
// it, and sums may grow to 2^28.
#ifndef TL_LIB_FIXED_POINT_GLSL
#define TL_LIB_FIXED_POINT_GLSL

#include "lib/math.glsl"
#include "shared/types.h"

const uint kFixedWords = 6; // of a colour
const float kFixedLimit = 1048576.0; // of a term

// (low, high) words of x, rounded. 0 <= x < kFixedLimit.
uvec2 fixedFromFloat(float x) {
    const float scaled = x * 16.0;
    const float high = floor(scaled);
    return uvec2(min((scaled - high) * 4294967296.0 + 0.5, 4294967040.0), high);
}

float floatFromFixed(uvec2 words) { return (float(words.y) + float(words.x) * (1.0 / 4294967296.0)) * (1.0 / 16.0); }

void fixedAdd(inout uvec2 sum, float x) {
    const uvec2 term = fixedFromFloat(x);
    uint carry;
    sum.x = uaddCarry(sum.x, term.x, carry);
    sum.y += term.y + carry;
}

// The low words of all terms overflow as often in one order as in another.
void fixedAtomicAdd(uintRef words, uint first, float x) {
    const uvec2 term = fixedFromFloat(x);
    const uint before = atomicAdd(words.v[first], term.x);
    const uint high = term.y + (before > ~term.x ? 1u : 0u);
    if (high != 0u) atomicAdd(words.v[first + 1u], high);
}

// False, and nothing added, for what is not finite or beyond the limit.
bool fixedAtomicAdd(uintRef words, uint first, vec3 x) {
    if (!(minComponent(x) >= 0.0 && maxComponent(x) < kFixedLimit)) return false;
    fixedAtomicAdd(words, first, x.r);
    fixedAtomicAdd(words, first + 2u, x.g);
    fixedAtomicAdd(words, first + 4u, x.b);
    return true;
}

vec3 fixedColor(uintRef words, uint first) {
    return vec3(floatFromFixed(uvec2(words.v[first], words.v[first + 1u])),
                floatFromFixed(uvec2(words.v[first + 2u], words.v[first + 3u])),
                floatFromFixed(uvec2(words.v[first + 4u], words.v[first + 5u])));
}

#endif
