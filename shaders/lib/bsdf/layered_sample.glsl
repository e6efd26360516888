// Sampling of the lobes declared in layered.glsl.
#ifndef TL_LIB_BSDF_LAYERED_SAMPLE_GLSL
#define TL_LIB_BSDF_LAYERED_SAMPLE_GLSL

// Takes the part of [0, 1) up to `p` where `u` is in it, and stretches it (else the rest) over [0, 1).
bool takeShare(inout float u, float p) {
    if (u < p) {
        u /= p;
        return true;
    }
    u = min((u - p) / (1.0 - p), kOneMinusEpsilon);
    return false;
}

// u.z chooses among lobes, deltas first (see bsdfDeltaProbability); u.xy the direction.
uint chooseLobe(Bsdf b, inout float u) {
    float left = 1.0;
    if (coatIsDelta(b)) {
        if (b.pCoat > 0.0 && takeShare(u, b.pCoat)) return kBsdfCoatLobe;
        left -= b.pCoat;
    }
    if (b.pInterface > 0.0 && takeShare(u, b.pInterface / left)) return kBsdfInterfaceLobe;
    if (!coatIsDelta(b) && b.pCoat > 0.0 && takeShare(u, b.pCoat / (left - b.pInterface))) return kBsdfCoatLobe;
    // What is left when rounding let `u` pass all others goes to one that exists.
    return b.pCosine > 0.0 ? kBsdfCosineLobe : b.pInterface > 0.0 ? kBsdfInterfaceLobe : kBsdfCoatLobe;
}

// wi by mirror reflection or refraction about microfacet h.
vec3 redirect(vec3 wo, vec3 h, float cosO, float eta, bool through) {
    if (!through) return 2.0 * cosO * h - wo;
    return (cosO / eta - safeSqrt(1.0 - (1.0 - cosO * cosO) / sqr(eta))) * h - wo / eta;
}

// Reflectance or transmittance of a smooth lobe.
vec3 deltaValue(Bsdf b, float cosO, float cosI, uint lobe, bool through) {
    float below = 1.0;
#if TL_BSDF_CLEARCOAT
    if (lobe == kBsdfCoatLobe) return vec3(b.coat * mix(b.coatF.x, b.coatF.y, schlickWeight(cosO)));
    below = b.belowCoat;
    if (through && b.coated.y) below = min(below, belowCoat(b, cosI));
#endif
#if TL_BSDF_TRANSMISSION
    if (through) return b.refracted * ((1.0 - fresnelDielectric(cosO, b.eta)) * below);
#endif
    return reflectedFresnel(b, cosO) * below;
}

// wi for `wo` from u in [0,1)^3, with probability bsdfDeltaProbability from a delta lobe (kBsdfDelta: pdfSolidAngle is
// its discrete probability), else with bsdfEval's density. Not valid: absorbed.
BsdfSample bsdfSample(Bsdf b, vec3 wo, vec3 u) {
    BsdfSample result = BsdfSample(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, 0u, 1.0);
    if (wo.z == 0.0 || !(b.pCosine + b.pInterface + b.pCoat > 0.0)) return result;
    const vec3 up = vec3(wo.xy, abs(wo.z));
    const uint lobe = chooseLobe(b, u.z);
    float probability = b.pInterface;
    float alpha = b.alpha;
    float eta = 1.0;
    bool delta = false;
    bool through = false;
    vec3 wi;

    if (lobe == kBsdfCosineLobe) {
        wi = sampleCosineHemisphere(u.xy);
#if TL_BSDF_TRANSMISSION
        through = u.z < b.throughShare;
        if (through) wi.z = -wi.z;
#endif
    } else {
        result.roughness = b.roughness;
#if TL_BSDF_CLEARCOAT
        if (lobe == kBsdfCoatLobe) {
            probability = b.pCoat;
            alpha = b.coatAlpha;
            result.roughness = b.coatRoughness;
        }
#endif
        const vec3 h = alpha > 0.0 ? sampleGgxVisibleNormal(up, alpha, u.xy) : vec3(0.0, 0.0, 1.0);
        const float cosO = clamp(dot(up, h), 0.0, 1.0);
        delta = alpha == 0.0;
#if TL_BSDF_TRANSMISSION
        eta = b.eta;
        if (lobe == kBsdfInterfaceLobe) {
            const float pThrough = throughProbability(b, cosO);
            through = u.z < pThrough;
            probability *= through ? pThrough : 1.0 - pThrough;
            delta = delta || (through && b.straight);
        }
#endif
        wi = delta && through ? redirect(up, vec3(0.0, 0.0, 1.0), up.z, eta, true) : redirect(up, h, cosO, eta, through);
    }
    if (wi.z == 0.0 || (wi.z < 0.0) != through) return result;

    result.wi = vec3(wi.xy, b.upward * wi.z);
    if (delta) {
        result.pdfSolidAngle = probability;
        result.roughness = 0.0;
        result.weight = deltaValue(b, up.z, abs(wi.z), lobe, through) / probability;
    } else {
        const vec3 value = bsdfEval(b, wo, result.wi, result.pdfSolidAngle);
        if (!(result.pdfSolidAngle > 0.0)) return result;
        result.weight = value / result.pdfSolidAngle;
    }
    result.flags = kBsdfValid | lobe | (delta ? kBsdfDelta : 0u) | (through ? kBsdfTransmission : 0u);
    return result;
}

#endif
