// Values and densities of the lobes declared in layered.glsl. Here wo.z > 0; wi.z < 0 is the other side.
#ifndef TL_LIB_BSDF_LAYERED_EVAL_GLSL
#define TL_LIB_BSDF_LAYERED_EVAL_GLSL

// Multiple scattering and diffuse base. `below`: the coat's factors for wi alone, and for both directions.
vec3 evalCosineLobe(Bsdf b, vec3 wi, float belowIn, float belowBoth, inout float pdf) {
    const float cosI = abs(wi.z);
    const float pdfCosine = b.pCosine * pdfSolidAngleCosineHemisphere(cosI);
    vec3 value = vec3(0.0);
    if (wi.z > 0.0) {
        float left = belowIn;
        if (b.keeps.y > 0.0 || b.multiple != vec3(0.0)) {
            const vec2 energy = ggxEnergy(cosI, b.roughness);
            const vec2 taken = takenByCoat(b, cosI);
            const float lost = lostOnce(energy, taken, belowIn);
            left = max(leftForBase(b, energy, taken, belowIn, lost), 0.0);
            value = b.multiple * lost;
        }
        value += b.diffuse * left;
#if TL_BSDF_TRANSMISSION
        if (b.multipleBack > 0.0) value += b.multipleBack * dielectricLoss(cosI, b.roughness, b.eta) * belowBoth;
        pdf += pdfCosine * (1.0 - b.throughShare);
    } else {
        if (b.throughShare > 0.0)
            value = b.multipleThrough * (dielectricLoss(cosI, b.roughness, 1.0 / b.eta) * belowBoth);
        pdf += pdfCosine * b.throughShare;
    }
#else
        pdf += pdfCosine;
    }
#endif
    return value * (cosI * kInvPi);
}

// GGX reflection without its Fresnel factor, times |cos_i|; `pdf` is that of reflecting about a visible normal.
float evalReflection(vec3 wo, vec3 wi, vec3 h, float alpha, out float pdf) {
    const float density = ggxDensity(h, alpha);
    const float slantO = ggxSlant(wo, alpha);
    pdf = density / (2.0 * (wo.z + slantO));
    return density * wi.z / (2.0 * (slantO * wi.z + ggxSlant(wi, alpha) * wo.z));
}

vec3 evalInterface(Bsdf b, vec3 wo, vec3 wi, inout float pdf) {
    if (b.alpha == 0.0 || b.pInterface == 0.0) return vec3(0.0);
    if (wi.z > 0.0) {
        const vec3 h = normalize(wo + wi);
        const float cosH = min(dot(wo, h), 1.0);
        float pdfReflection;
        const float value = evalReflection(wo, wi, h, b.alpha, pdfReflection);
        pdf += b.pInterface * (1.0 - throughProbability(b, cosH)) * pdfReflection;
        return value * reflectedFresnel(b, cosH);
    }
#if TL_BSDF_TRANSMISSION
    // Walter et al. 2007, eqs. 16, 17, 21: the half vector is along wo + eta wi, and |wo.h + eta wi.h| is its length.
    if (b.dielectric == 0.0 || b.straight) return vec3(0.0);
    vec3 h = wo + b.eta * wi;
    const float length2 = dot(h, h);
    h *= (h.z < 0.0 ? -1.0 : 1.0) * inversesqrt(length2);
    const float cosO = min(dot(wo, h), 1.0);
    const float cosI = -dot(wi, h);
    if (!(cosO > 0.0 && cosI > 0.0)) return vec3(0.0);
    const float slantO = ggxSlant(wo, b.alpha);
    const float spread = ggxDensity(h, b.alpha) * cosO * cosI * sqr(b.eta) * 2.0 / length2;
    pdf += b.pInterface * throughProbability(b, cosO) * spread / (wo.z + slantO);
    return b.refracted * ((1.0 - fresnelDielectric(cosO, b.eta)) * spread * -wi.z /
                          (slantO * -wi.z + ggxSlant(wi, b.alpha) * wo.z));
#else
    return vec3(0.0);
#endif
}

// f |cos_i| of all lobes that are not deltas, and the density with which bsdfSample makes wi from them.
vec3 bsdfEval(Bsdf b, vec3 wo, vec3 wi, out float pdfSolidAngle) {
    pdfSolidAngle = 0.0;
    wo.z = abs(wo.z);
    wi.z *= b.upward;
#if TL_BSDF_TRANSMISSION
    if (wo.z == 0.0 || wi.z == 0.0 || (wi.z < 0.0 && b.dielectric == 0.0)) return vec3(0.0);
#else
    if (wo.z == 0.0 || wi.z <= 0.0) return vec3(0.0);
#endif
    float belowIn = 1.0, belowBoth = 1.0;
#if TL_BSDF_CLEARCOAT
    if (wi.z > 0.0 ? b.coated.x : b.coated.y) belowIn = belowCoat(b, abs(wi.z));
    belowBoth = min(belowIn, b.belowCoat);
#endif
    vec3 value = evalCosineLobe(b, wi, belowIn, belowBoth, pdfSolidAngle);
    value += evalInterface(b, wo, wi, pdfSolidAngle) * belowBoth;
#if TL_BSDF_CLEARCOAT
    if (b.pCoat > 0.0 && b.coatAlpha > 0.0 && wi.z > 0.0) {
        const vec3 h = normalize(wo + wi);
        float pdfCoat;
        const float coat = evalReflection(wo, wi, h, b.coatAlpha, pdfCoat);
        value += b.coat * mix(b.coatF.x, b.coatF.y, schlickWeight(dot(wo, h))) * coat;
        pdfSolidAngle += b.pCoat * pdfCoat;
    }
#endif
    return value;
}

#endif
