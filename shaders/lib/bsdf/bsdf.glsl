// The layered surface model of trilume::Material: clearcoat over a mix of metal, dielectric over diffuse, and refracting
// dielectric. Directions are unit, local, z along the shading normal; both sides of the surface are shaded.
//
// Three lobes are sampled:
//   cosine     diffuse base, and the energy that rough interfaces scatter more than once (Kulla & Conty 2017)
//   interface  GGX: one microfacet normal reflects (metal, dielectric) or refracts
//   coat       GGX clearcoat
// Roughness up to kDeltaRoughness is a perfect mirror or smooth refraction: a blur of 1e-4 radians, below any pixel.
//
// TL_BSDF_SPECULAR 0 leaves Lambert alone; TL_BSDF_TRANSMISSION 0 and TL_BSDF_CLEARCOAT 0 leave those layers out;
// with TL_BSDF_ROUGH 0 all lobes but the cosine one are deltas.
#ifndef TL_LIB_BSDF_BSDF_GLSL
#define TL_LIB_BSDF_BSDF_GLSL

#ifndef TL_BSDF_SPECULAR
#define TL_BSDF_SPECULAR 1
#endif
#ifndef TL_BSDF_ROUGH
#define TL_BSDF_ROUGH TL_BSDF_SPECULAR
#endif
#ifndef TL_BSDF_TRANSMISSION
#define TL_BSDF_TRANSMISSION TL_BSDF_SPECULAR
#endif
#ifndef TL_BSDF_CLEARCOAT
#define TL_BSDF_CLEARCOAT TL_BSDF_SPECULAR
#endif

#include "lib/color.glsl"
#include "lib/math.glsl"
#include "lib/sampling.glsl"
#if TL_BSDF_SPECULAR
#include "lib/bsdf/microfacet.glsl"
#include "lib/bsdf/tables.glsl"
#endif

// A material at a point, textures applied. Colours and shares in [0, 1]; roughness is perceptual, alpha its square.
struct BsdfParams {
    vec3 baseColor;
    float metallic;
    vec3 specularColor;
    float roughness;
    vec3 transmissionColor;
    float transmission;
    float ior;
    float specular;
    float clearcoat;
    float clearcoatRoughness;
    float clearcoatIor;
    bool specularWorkflow;
};

// What a path carries decides the factor of refraction: radiance grows by the square of the index ratio, importance
// (paths from lights) does not. Veach 1997, 5.2.
const uint kTransportRadiance = 0;
const uint kTransportImportance = 1;

const float kDeltaRoughness = 0.01;

const uint kBsdfValid = 1;
const uint kBsdfDelta = 2;        // pdfSolidAngle is the discrete probability
const uint kBsdfTransmission = 4; // wi is on the other side
const uint kBsdfCosineLobe = 8;
const uint kBsdfInterfaceLobe = 16;
const uint kBsdfCoatLobe = 32;

// A roughness no less than `least`, unless it is a mirror's.
float bsdfWidened(float roughness, float least) {
    return roughness > kDeltaRoughness ? max(roughness, least) : roughness;
}

struct BsdfSample {
    vec3 wi;
    vec3 weight; // f |cos| / pdf, at most 1 for radiance inside one medium
    float pdfSolidAngle;
    uint flags;
    float roughness; // of the lobe that was sampled, perceptual; diffuse: 1
};

#if TL_BSDF_SPECULAR
#include "lib/bsdf/layered.glsl"
#else
#include "lib/bsdf/lambert.glsl"
#endif

Bsdf bsdfPrepare(BsdfParams p, vec3 wo, bool frontSide) { return bsdfPrepare(p, wo, frontSide, kTransportRadiance); }

// The density in solid angle with which bsdfSample makes `wi` from `wo`; for the reverse density swap the two and give
// the side of wi.
float bsdfPdf(BsdfParams p, vec3 wo, vec3 wi, bool frontSide) {
    float pdfSolidAngle;
    bsdfEval(bsdfPrepare(p, wo, frontSide), wo, wi, pdfSolidAngle);
    return pdfSolidAngle;
}

#endif
