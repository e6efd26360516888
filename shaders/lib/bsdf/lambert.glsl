// The BSDF library where no material is anything but diffuse. Included by bsdf.glsl.
#ifndef TL_LIB_BSDF_LAMBERT_GLSL
#define TL_LIB_BSDF_LAMBERT_GLSL

struct Bsdf {
    vec3 albedo;
};

Bsdf bsdfPrepare(BsdfParams p, vec3 wo, bool frontSide, uint transport) { return Bsdf(saturate(p.baseColor)); }

bool bsdfHasSmooth(Bsdf b) { return !isBlack(b.albedo); }
bool bsdfRefractsRoughly(Bsdf b) { return false; }
float bsdfDeltaProbability(Bsdf b) { return 0.0; }
float bsdfSharpestRoughness(Bsdf b) { return 1.0; }
vec3 bsdfAlbedo(Bsdf b) { return b.albedo; }
vec3 bsdfSmoothAlbedo(Bsdf b) { return b.albedo; }
vec3 bsdfCosineAlbedo(Bsdf b) { return b.albedo; }

vec3 bsdfEval(Bsdf b, vec3 wo, vec3 wi, out float pdfSolidAngle) {
    pdfSolidAngle = wo.z * wi.z > 0.0 ? pdfSolidAngleCosineHemisphere(abs(wi.z)) : 0.0;
    return b.albedo * pdfSolidAngle;
}

BsdfSample bsdfSample(Bsdf b, vec3 wo, vec3 u) {
    vec3 wi = sampleCosineHemisphere(u.xy);
    const float pdf = pdfSolidAngleCosineHemisphere(wi.z);
    if (wo.z < 0.0) wi.z = -wi.z;
    return BsdfSample(wi, b.albedo, pdf, pdf > 0.0 && wo.z != 0.0 ? kBsdfValid | kBsdfCosineLobe : 0u, 1.0);
}

#endif
