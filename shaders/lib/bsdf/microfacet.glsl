// GGX microfacets with height-correlated Smith masking, and Fresnel factors. Local frame, z along the normal, wo.z > 0.
#ifndef TL_LIB_BSDF_MICROFACET_GLSL
#define TL_LIB_BSDF_MICROFACET_GLSL

#include "lib/math.glsl"

// Unpolarised reflectance of a smooth dielectric; eta: index beyond over index before. 1 in total reflection.
float fresnelDielectric(float cosI, float eta) {
    const float cos2T = 1.0 - (1.0 - cosI * cosI) / (eta * eta);
    if (cos2T <= 0.0) return 1.0;
    const float cosT = sqrt(cos2T);
    const float parallel = (eta * cosI - cosT) / (eta * cosI + cosT);
    const float perpendicular = (cosI - eta * cosT) / (cosI + eta * cosT);
    return 0.5 * (sqr(parallel) + sqr(perpendicular));
}

// Normal-incidence reflectance of an index ratio.
float f0FromIor(float ior) { return sqr((1.0 - ior) / (1.0 + ior)); }

// Schlick's factor at grazing angles: 1 for anything that reflects at all, going to 0 with F0 below 2%, so that an index
// ratio of 1 has no specular lobe and neighbouring ratios almost none.
float f90FromF0(float f0) { return min(50.0 * f0, 1.0); }

float schlickWeight(float cosI) { return pow5(saturate(1.0 - cosI)); }

// Walter et al. 2007, eq. 33, without cancellation for small alpha.
float ggxDensity(vec3 h, float alpha) {
    const float a2 = alpha * alpha;
    return a2 * kInvPi / sqr(a2 * h.z * h.z + dot(h.xy, h.xy));
}

// s(w) = |cos| sqrt(1 + alpha^2 tan^2). Smith's G1 is 2 |cos| / (|cos| + s), and the height-correlated G2 of two
// directions is 2 |cos_o| |cos_i| / (s_o |cos_i| + s_i |cos_o|) (Heitz 2014, eq. 99): nothing to divide at grazing angles.
float ggxSlant(vec3 w, float alpha) { return sqrt(w.z * w.z + alpha * alpha * dot(w.xy, w.xy)); }

// A normal with density G1(wo) max(0, wo.h) D(h) / wo.z in solid angle. Dupuy & Benyoub 2023, "Sampling Visible GGX
// Normals with Spherical Caps".
vec3 sampleGgxVisibleNormal(vec3 wo, float alpha, vec2 u) {
    const vec3 up = normalize(vec3(alpha * wo.xy, wo.z));
    const float z = (1.0 - u.y) * (1.0 + up.z) - up.z;
    const float s = safeSqrt(1.0 - z * z);
    const float phi = kTwoPi * u.x;
    const vec3 h = vec3(s * cos(phi), s * sin(phi), z) + up;
    return normalize(vec3(alpha * h.xy, max(h.z, 1e-7)));
}

#endif
