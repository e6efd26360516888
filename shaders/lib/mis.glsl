// Veach 1997, chapter 9: weights of the strategy with density `a` against one with density `b`, in the same measure.
// Finite for any densities in [0, inf]; an infinite density (a delta) takes all.
#ifndef TL_LIB_MIS_GLSL
#define TL_LIB_MIS_GLSL

#include "lib/math.glsl"

float balanceHeuristic(float a, float b) {
    a = min(a, 0.5 * kFloatMax);
    b = min(b, 0.5 * kFloatMax);
    return a > 0.0 ? a / (a + b) : 0.0;
}

// Exponent 2. The ratio is taken first: squares of densities overflow early.
float powerHeuristic(float a, float b) {
    a = min(a, kFloatMax);
    b = min(b, kFloatMax);
    if (a >= b) return a > 0.0 ? 1.0 / (1.0 + sqr(b / a)) : 0.0;
    const float r = sqr(a / b);
    return r / (1.0 + r);
}

#endif
