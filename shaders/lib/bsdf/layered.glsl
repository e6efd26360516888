// The BSDF library with all layers. Included by bsdf.glsl, which says what they are.
//
// Coupling between layers is reciprocal and never gains energy. E(w) is the share of light that a layer keeps from what is
// below it. Diffuse below takes (1 - E(wo)) (1 - E(wi)) / mean(1 - E) (Kelemen & Szirmay-Kalos 2001), which is exact for
// white; directional lobes below the coat take min(1 - E(wo), 1 - E(wi)), as the former would gain energy on a mirror. What
// that loses on a rough opaque interface scatters on: to the diffuse base, and on metal with what single scattering loses.
#ifndef TL_LIB_BSDF_LAYERED_GLSL
#define TL_LIB_BSDF_LAYERED_GLSL

struct Bsdf {
    float upward;       // sign of wo.z
    vec3 albedo;
    vec3 cosineAlbedo, deltaAlbedo; // parts of it: of the cosine lobe where it reflects, of the delta lobes
    vec3 diffuse;       // of the cosine lobe, before the factors of wi
    float pCosine, pInterface, pCoat; // sampling probabilities
    float alpha;        // 0: delta
    float roughness;
    vec3 f0, f90;       // Schlick factors of metal and opaque dielectric, with their shares
    vec2 keeps;         // F0 and F90 of the dielectric over the diffuse base
    float keepsMultiple;
    vec3 multiple;      // multiple scattering by the opaque interface, before lostOnce(wi)
#if TL_BSDF_TRANSMISSION
    float dielectric;   // share of the refracting dielectric
    vec3 refracted;     // the same with its tint and, for radiance, the factor of refraction
    float tint;         // luminance of the tint
    float eta;          // index beyond over index on wo's side
    bool straight;      // refraction is a delta though reflection may not be: indices match
    float pStraight;    // then: of the interface lobe, the probability of going through
    float multipleBack; // multiple scattering by the refracting interface, back and through
    vec3 multipleThrough;
    float throughShare; // of the cosine lobe
#endif
#if TL_BSDF_CLEARCOAT
    float coat;
    float coatAlpha, coatRoughness;
    vec2 coatF;         // F0 and F90
    float belowCoat;    // 1 - coat E(wo); 1 where wo's side has no coat
    float coatRise;     // of coat E toward grazing angles; 0 where wo's side has no coat
    bvec2 coated;       // wo's side, the other side
#endif
};

// Perceptual roughness of a lobe; 0: delta.
float lobeRoughness(float roughness) { return TL_BSDF_ROUGH != 0 && roughness > kDeltaRoughness ? roughness : 0.0; }

// What a white surface with these Schlick factors sends back in all, from what single scattering loses.
vec3 schlickMean(vec3 f0, float f90) { return f0 + (f90 - f0) / 21.0; }
vec3 multipleScattering(vec3 fMean, float lossMean) { return fMean * fMean * (1.0 - lossMean) / (1.0 - fMean * lossMean); }

// Energy of a Schlick lobe, from ggxEnergy.
float schlickEnergy(vec2 f, vec2 energy) { return f.x * (1.0 - energy.x - energy.y) + f.y * energy.y; }

vec3 reflectedFresnel(Bsdf b, float cosI) {
    vec3 f = mix(b.f0, b.f90, schlickWeight(cosI));
#if TL_BSDF_TRANSMISSION
    if (b.dielectric > 0.0) f += b.dielectric * fresnelDielectric(cosI, b.eta);
#endif
    return f;
}

#if TL_BSDF_TRANSMISSION
float throughByFresnel(Bsdf b, float cosI) {
    const float fresnel = fresnelDielectric(cosI, b.eta);
    const float through = b.dielectric * (1.0 - fresnel) * b.tint;
    const float back = luminance(mix(b.f0, b.f90, schlickWeight(cosI))) + b.dielectric * fresnel;
    return through / max(through + back, 1e-30);
}
#endif

// Of the interface lobe with a microfacet seen under cosI: the probability of going through it.
float throughProbability(Bsdf b, float cosI) {
#if TL_BSDF_TRANSMISSION
    if (b.dielectric > 0.0) return b.straight ? b.pStraight : throughByFresnel(b, cosI);
#endif
    return 0.0;
}

#if TL_BSDF_CLEARCOAT
float belowCoat(Bsdf b, float cosTheta) {
    return 1.0 - b.coat * schlickEnergy(b.coatF, ggxEnergy(cosTheta, b.coatRoughness));
}
vec2 takenByCoat(Bsdf b, float cosTheta) {
    return b.coatRise > 0.0 ? b.coatRise * ggxCoated(cosTheta, b.roughness, b.coatRoughness) : vec2(0.0);
}
#else
vec2 takenByCoat(Bsdf b, float cosTheta) { return vec2(0.0); }
#endif

// What single scattering below the coat would lose with Fresnel factor 1. `below`: belowCoat; `taken`: takenByCoat.
float lostOnce(vec2 energy, vec2 taken, float below) { return energy.x * below + taken.x + taken.y; }

// What the coat and the dielectric leave for the diffuse base, before division by its mean.
float leftForBase(Bsdf b, vec2 energy, vec2 taken, float below, float lost) {
    return below * (1.0 - schlickEnergy(b.keeps, energy)) + dot(b.keeps, taken) - b.keepsMultiple * lost;
}

#if TL_BSDF_TRANSMISSION
// Smooth refraction of white light has mean reflectance by Kulla & Conty 2017's fits.
float fresnelDielectricMean(float eta) {
    return eta >= 1.0 ? (eta - 1.0) / (4.08567 + 1.00071 * eta)
                      : 0.997118 + eta * (0.1014 + eta * (-0.965241 - eta * 0.130607));
}

// Energy lost by single scattering goes back and through as cosine lobes. Reciprocity asks that the share x going through
// from either side satisfies x_o eta_o^2 loss_o = x_i eta_i^2 loss_i; each is at most that of smooth refraction. Returns the loss.
float prepareDielectricMultiple(inout Bsdf b, float cosO) {
    const vec2 mean = vec2(dielectricLossMean(b.roughness, b.eta), dielectricLossMean(b.roughness, 1.0 / b.eta));
    const vec2 flux = vec2(1.0, b.eta * b.eta) * mean;
    if (!(min(flux.x, flux.y) > 1e-6)) return 0.0;
    const vec2 through = 1.0 - vec2(fresnelDielectricMean(b.eta), fresnelDielectricMean(1.0 / b.eta));
    b.throughShare = min(through.x, through.y * flux.y / flux.x);
    const float loss = dielectricLoss(cosO, b.roughness, b.eta);
    b.multipleBack = b.dielectric * loss * (1.0 - b.throughShare) / mean.x;
    b.multipleThrough = b.refracted * loss * b.throughShare / mean.y;
    return loss;
}
#endif

// `frontSide`: wo is on the front side of the geometric normal, which for a dielectric is the outside.
Bsdf bsdfPrepare(BsdfParams p, vec3 wo, bool frontSide, uint transport) {
    Bsdf b;
    const float cosO = min(abs(wo.z), 1.0);
    b.upward = wo.z < 0.0 ? -1.0 : 1.0;
    b.roughness = lobeRoughness(p.roughness);
    b.alpha = sqr(b.roughness);
    const float metallic = p.specularWorkflow ? 0.0 : p.metallic;
    const float ior = max(p.ior, 1e-3);
    const vec3 base = saturate(p.baseColor);
#if TL_BSDF_TRANSMISSION
    const float opaque = (1.0 - metallic) * (1.0 - p.transmission);
#else
    const float opaque = 1.0 - metallic;
#endif

    const vec3 dielectricF0 = p.specularWorkflow ? p.specularColor : saturate(p.specularColor * f0FromIor(ior));
    const float metalF90 = f90FromF0(maxComponent(base)), dielectricF90 = f90FromF0(maxComponent(dielectricF0));
    b.f0 = metallic * base + (opaque * p.specular) * dielectricF0;
    b.f90 = vec3(metallic * metalF90 + opaque * p.specular * dielectricF90);
    b.keeps = p.specular * vec2(maxComponent(dielectricF0), dielectricF90);

    // Weights of the lobes, proportional to their albedo seen from wo.
    float cosineWeight = 0.0, interfaceWeight = 0.0, coatWeight = 0.0;
    b.diffuse = opaque * base;
    b.multiple = vec3(0.0);
    b.keepsMultiple = 0.0;
    b.albedo = b.cosineAlbedo = b.deltaAlbedo = vec3(0.0);
    float below = 1.0, meanBelow = 1.0; // what passes the coat from wo, and its mean

#if TL_BSDF_CLEARCOAT
    b.coat = p.clearcoat;
    b.coatRoughness = lobeRoughness(p.clearcoatRoughness);
    b.coatAlpha = sqr(b.coatRoughness);
    b.coatF.x = f0FromIor(max(p.clearcoatIor, 1e-3));
    b.coatF.y = f90FromF0(b.coatF.x);
    const bool refracts = p.transmission > 0.0 && metallic < 1.0;
    // Opaque surfaces are the same from both sides; a coat lies on the outside of one that refracts.
    b.coated = bvec2(b.coat > 0.0 && (frontSide || !refracts), b.coat > 0.0 && (!frontSide || !refracts));
    if (b.coated.x) {
        below = belowCoat(b, cosO);
        meanBelow = 1.0 - b.coat * schlickEnergy(b.coatF, ggxEnergyMean(b.coatRoughness));
        coatWeight = 1.0 - below;
        b.albedo += coatWeight;
        if (b.coatAlpha == 0.0) b.deltaAlbedo += coatWeight;
    }
    b.belowCoat = below;
    b.coatRise = b.coated.x ? b.coat * (b.coatF.y - b.coatF.x) : 0.0;
#endif

    float left = below, meanLeft = meanBelow; // for the diffuse base
    if (b.f90.x > 0.0 || b.keeps.y > 0.0) {
        const vec2 energy = ggxEnergy(cosO, b.roughness);
        const vec2 mean = ggxEnergyMean(b.roughness);
        const vec2 taken = takenByCoat(b, cosO);
        vec2 meanTaken = vec2(0.0), covariance = vec2(0.0); // of what passes the coat with lost and reflected energy
#if TL_BSDF_CLEARCOAT
        if (b.coatRise > 0.0) {
            const vec4 coated = b.coatRise * ggxCoatedMean(b.roughness, b.coatRoughness);
            meanTaken = coated.xy;
            covariance = -coated.zw;
        }
#endif
        const float lost = lostOnce(energy, taken, below);
        const float meanLost = lostOnce(mean, meanTaken, meanBelow) + covariance.x;
        if (b.alpha > 0.0 && meanLost > 0.0) {
            const float lostShare = meanLost / max(meanBelow, 1e-6);
            const vec3 dielectric = multipleScattering(p.specular * schlickMean(dielectricF0, dielectricF90), lostShare);
            b.multiple = (metallic * multipleScattering(schlickMean(base, metalF90), lostShare) + opaque * dielectric) *
                         (lost / meanLost);
            b.keepsMultiple = maxComponent(dielectric);
        }
        left = leftForBase(b, energy, taken, below, lost);
        meanLeft = leftForBase(b, mean, meanTaken, meanBelow, meanLost) + b.keeps.x * (covariance.x + covariance.y) -
                   b.keeps.y * covariance.y;
        const vec3 single = b.f0 * ((1.0 - energy.x - energy.y) * below - taken.x) + b.f90 * (energy.y * below - taken.y);
        interfaceWeight = luminance(single);
        b.cosineAlbedo = b.multiple * meanLost;
        b.albedo += single + b.cosineAlbedo;
        if (b.alpha == 0.0) b.deltaAlbedo += single;
        cosineWeight = luminance(b.cosineAlbedo);
    }

#if TL_BSDF_TRANSMISSION
    b.dielectric = (1.0 - metallic) * p.transmission;
    b.eta = frontSide ? ior : 1.0 / ior;
    b.refracted = saturate(p.transmissionColor);
    b.tint = luminance(b.refracted);
    b.refracted *= b.dielectric * (transport == kTransportRadiance ? 1.0 / sqr(b.eta) : 1.0);
    // Half vectors of refraction lose their digits as the indices meet.
    b.straight = b.alpha * abs(b.eta - 1.0) <= 2e-5;
    b.multipleBack = b.throughShare = 0.0;
    b.multipleThrough = vec3(0.0);
    b.pStraight = 0.0;
    if (b.dielectric > 0.0) {
        b.pStraight = throughByFresnel(b, cosO);
        const float loss = b.straight ? 0.0 : prepareDielectricMultiple(b, cosO);
        interfaceWeight += below * b.dielectric * (1.0 - loss) * mix(1.0, b.tint, 1.0 - fresnelDielectric(cosO, b.eta));
        const float multiple = below * b.dielectric * loss;
        cosineWeight += multiple;
        b.cosineAlbedo += multiple * (1.0 - b.throughShare);
        b.throughShare *= multiple; // the rest of the cosine lobe reflects
        const vec3 through = below * b.dielectric * saturate(p.transmissionColor);
        b.albedo += through;
        if (b.alpha == 0.0 || b.straight) b.deltaAlbedo += through;
    }
#endif

    b.diffuse *= max(left, 0.0);
    b.albedo += b.diffuse;
    b.cosineAlbedo += b.diffuse;
    cosineWeight += luminance(b.diffuse);
    b.diffuse /= max(meanLeft, 1e-6);
    const float sum = cosineWeight + interfaceWeight + coatWeight;
    const float scale = sum > 0.0 ? 1.0 / sum : 0.0;
    b.pCosine = cosineWeight * scale;
    b.pInterface = interfaceWeight * scale;
    b.pCoat = coatWeight * scale;
#if TL_BSDF_TRANSMISSION
    b.throughShare /= max(cosineWeight, 1e-30);
#endif
    return b;
}

#if TL_BSDF_CLEARCOAT
bool coatIsDelta(Bsdf b) { return b.coatAlpha == 0.0; }
#else
bool coatIsDelta(Bsdf b) { return true; }
#endif

// Whether a part of the light goes through that no delta lobe carries.
bool bsdfRefractsRoughly(Bsdf b) {
#if TL_BSDF_TRANSMISSION && TL_BSDF_ROUGH
    return b.dielectric > 0.0 && b.alpha > 0.0;
#else
    return false;
#endif
}

// Probability that bsdfSample takes a delta lobe, which it does where u.z is below it.
float bsdfDeltaProbability(Bsdf b) {
    float p = coatIsDelta(b) ? b.pCoat : 0.0;
    if (b.alpha == 0.0) p += b.pInterface;
#if TL_BSDF_TRANSMISSION
    else if (b.straight) p += b.pInterface * b.pStraight;
#endif
    return p;
}

bool bsdfHasSmooth(Bsdf b) {
    return b.pCosine > 0.0 || (b.alpha > 0.0 && b.pInterface > 0.0) || (!coatIsDelta(b) && b.pCoat > 0.0);
}

// Perceptual roughness of the sharpest lobe that is no delta; the cosine lobe's is 1.
float bsdfSharpestRoughness(Bsdf b) {
    float roughness = b.alpha > 0.0 && b.pInterface > 0.0 ? b.roughness : 1.0;
#if TL_BSDF_CLEARCOAT
    if (!coatIsDelta(b) && b.pCoat > 0.0) roughness = min(roughness, b.coatRoughness);
#endif
    return roughness;
}

// Approximate directional albedo, for demodulation.
vec3 bsdfAlbedo(Bsdf b) { return b.albedo; }
// The same without delta lobes, and of the cosine lobe's reflection alone: what they send towards wo of light that comes from
// everywhere alike.
vec3 bsdfSmoothAlbedo(Bsdf b) { return max(b.albedo - b.deltaAlbedo, vec3(0.0)); }
vec3 bsdfCosineAlbedo(Bsdf b) { return b.cosineAlbedo; }

// All lobes but the cosine one.
Bsdf bsdfWithoutCosine(Bsdf b) {
    const float sum = b.pInterface + b.pCoat;
    b.diffuse = b.multiple = vec3(0.0);
    b.pCosine = 0.0;
    b.pInterface = sum > 0.0 ? b.pInterface / sum : 0.0;
    b.pCoat = sum > 0.0 ? 1.0 - b.pInterface : 0.0;
#if TL_BSDF_TRANSMISSION
    b.multipleBack = b.throughShare = 0.0;
    b.multipleThrough = vec3(0.0);
#endif
    return b;
}

#include "lib/bsdf/layered_eval.glsl"
#include "lib/bsdf/layered_sample.glsl"

#endif
