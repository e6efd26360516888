// Functions whose relative error matters to light sampling. Vulkan leaves atan 4096 ulp and sin an absolute error of
// 2^-11, so a light seen under 1e-4 radians would be sampled at random; drivers do use that freedom.
#ifndef TL_LIB_LIGHT_NUMERIC_GLSL
#define TL_LIB_LIGHT_NUMERIC_GLSL

#include "lib/math.glsl"

// Angle of (x, y) in [-pi, pi], relative error about 2e-7. Reduction to [0, tan(pi/8)], then the odd minimax polynomial
// of Cephes (Moshier 1989).
float accurateAtan2(float y, float x) {
    const float ay = abs(y), ax = abs(x);
    const float small = min(ax, ay), large = max(ax, ay);
    if (!(large > 0.0)) return 0.0;
    const bool upper = small > 0.41421356 * large;
    const float q = upper ? (small - large) / (small + large) : small / large;
    const float z = q * q;
    float angle = (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * q + q;
    if (upper) angle += 0.25 * kPi;
    if (ay > ax) angle = 0.5 * kPi - angle;
    if (x < 0.0) angle = kPi - angle;
    return y < 0.0 ? -angle : angle;
}

// (cos x, sin x), the sine with a relative error near 1e-7 where x is small.
vec2 accurateCosSin(float x) {
    if (abs(x) > 0.5) return vec2(cos(x), sin(x));
    const float z = x * x;
    const float s = x * (1.0 + z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * (-1.0 / 5040.0))));
    const float c = 1.0 + z * (-0.5 + z * (1.0 / 24.0 + z * (-1.0 / 720.0 + z * (1.0 / 40320.0))));
    return vec2(c, s);
}

// Growth of the sine of elevation, x / |(x, t)|, from x0 to x1 along a line at distance t; x0 <= x1. Where both lie on one
// side the difference is expanded so that it doesn't cancel.
float elevationRange(float x0, float x1, float t) {
    const float r0 = length(vec2(x0, t)), r1 = length(vec2(x1, t));
    if (x0 * x1 <= 0.0) return x1 / r1 - x0 / r0;
    return (t / r0) * (t / r1) * ((x1 - x0) * (x0 + x1)) / (x1 * r0 + x0 * r1);
}

#endif
