// Maps from the unit square to common densities. Directions are local, z up; each pdf names its measure.
#ifndef TL_LIB_SAMPLING_GLSL
#define TL_LIB_SAMPLING_GLSL

#include "lib/math.glsl"

// Uniform on the unit disk, pdfArea 1/pi. Shirley & Chiu 1997, in the branch-light form of Cline.
vec2 sampleDisk(vec2 u) {
    const vec2 p = 2.0 * u - 1.0;
    const bool wide = abs(p.x) > abs(p.y);
    const float r = wide ? p.x : p.y;
    const float q = r == 0.0 ? 0.0 : (wide ? p.y : p.x) / r;
    const float phi = 0.25 * kPi * q;
    const vec2 cs = vec2(cos(phi), sin(phi));
    return r * (wide ? cs : cs.yx);
}

vec3 sampleCosineHemisphere(vec2 u) {
    const vec2 d = sampleDisk(u);
    return vec3(d, safeSqrt(1.0 - dot(d, d)));
}
float pdfSolidAngleCosineHemisphere(float cosTheta) { return max(cosTheta, 0.0) * kInvPi; }

vec3 directionFromCosPhi(float cosTheta, float phi) {
    const float sinTheta = safeSqrt(1.0 - cosTheta * cosTheta);
    return vec3(sinTheta * cos(phi), sinTheta * sin(phi), cosTheta);
}

vec3 sampleSphere(vec2 u) { return directionFromCosPhi(1.0 - 2.0 * u.x, kTwoPi * u.y); }
float pdfSolidAngleSphere() { return kInvFourPi; }

vec3 sampleHemisphere(vec2 u) { return directionFromCosPhi(1.0 - u.x, kTwoPi * u.y); }
float pdfSolidAngleHemisphere() { return kInvTwoPi; }

// Uniform in the cone about z. `oneMinusCos` of the half angle rather than the cosine, so that narrow cones keep precision:
// for a sphere seen under sin^2 = s2 it is s2 / (1 + sqrt(1 - s2)).
vec3 sampleCone(vec2 u, float oneMinusCos) {
    const float h = u.x * oneMinusCos;                // 1 - cos(theta)
    const float sinTheta = safeSqrt(h * (2.0 - h));
    const float phi = kTwoPi * u.y;
    return vec3(sinTheta * cos(phi), sinTheta * sin(phi), 1.0 - h);
}
float pdfSolidAngleCone(float oneMinusCos) { return kInvTwoPi / oneMinusCos; }

// Barycentrics (of corners 1 and 2) uniform by area. Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
vec2 sampleTriangle(vec2 u) {
    if (u.y > u.x) {
        u.x *= 0.5;
        u.y -= u.x;
    } else {
        u.y *= 0.5;
        u.x -= u.y;
    }
    return u;
}

#endif
