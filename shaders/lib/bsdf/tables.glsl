// Energy that single scattering by GGX surfaces loses, from the tables laid out in shared/bsdf_tables.h.
// The includer defines TL_BSDF_TABLES, an expression of type uintRef.
#ifndef TL_LIB_BSDF_TABLES_GLSL
#define TL_LIB_BSDF_TABLES_GLSL

#include "lib/math.glsl"
#include "shared/bsdf_tables.h"

float bsdfTableFloat(uint i) { return uintBitsToFloat(TL_BSDF_TABLES.v[i]); }
vec2 ggxEntry(uint i) { return unpackUnorm2x16(TL_BSDF_TABLES.v[i]); }

// Splits a coordinate in [0, 1] over `size` nodes into the lower node and the share of the next.
uint tableNode(float x, uint size, out float share) {
    const float node = min(floor(saturate(x) * float(size - 1u)), float(size - 2u));
    share = saturate(x) * float(size - 1u) - node;
    return uint(node);
}

vec2 ggxLookup(uint table, uint size, float cosTheta, float roughness) {
    vec2 f;
    const uint x = tableNode(sqrt(cosTheta), size, f.x);
    const uint i = table + tableNode(roughness, size, f.y) * size + x;
    return mix(mix(ggxEntry(i), ggxEntry(i + 1u), f.x), mix(ggxEntry(i + size), ggxEntry(i + size + 1u), f.x), f.y);
}
float ggxMean(uint which, float roughness) {
    float f;
    const uint i = kGgxMeanOffset + kGgxMeans * tableNode(roughness, kGgxSize, f) + which;
    return mix(bsdfTableFloat(i), bsdfTableFloat(i + kGgxMeans), f);
}

// x: energy lost with Fresnel factor 1; y: energy reflected with factor (1 - cos)^5. So F0 and F90 give, together,
// F0 (1 - x - y) + F90 y.
vec2 ggxEnergy(float cosTheta, float roughness) { return ggxLookup(0u, kGgxSize, cosTheta, roughness); }
vec2 ggxEnergyMean(float roughness) { return vec2(ggxMean(0u, roughness), ggxMean(1u, roughness)); }

// What a coat with Fresnel factors from 0 to 1 takes from light reflected below it, beyond what it takes from a mirror; per
// unit of F0 and F90 below. Of its means, z and w are the covariances of what the coat reflects with ggxEnergy.
vec2 ggxCoated(float cosTheta, float roughness, float coatRoughness) {
    float f;
    const uint slice = kCoatedSize * kCoatedSize;
    const uint table = kCoatedOffset + tableNode(coatRoughness, kCoatRoughnesses, f) * slice;
    return mix(ggxLookup(table, kCoatedSize, cosTheta, roughness),
               ggxLookup(table + slice, kCoatedSize, cosTheta, roughness), f);
}
vec4 ggxCoatedMean(float roughness, float coatRoughness) {
    vec2 f;
    const uint y = tableNode(roughness, kCoatedSize, f.x);
    const uint first = kCoatedMeanOffset + 4u * (tableNode(coatRoughness, kCoatRoughnesses, f.y) * kCoatedSize + y);
    vec4 mean;
    for (uint k = 0u; k < 4u; ++k) {
        const uint i = first + k, next = i + 4u * kCoatedSize;
        mean[k] = mix(mix(bsdfTableFloat(i), bsdfTableFloat(i + 4u), f.x),
                      mix(bsdfTableFloat(next), bsdfTableFloat(next + 4u), f.x), f.y);
    }
    return mean;
}

float dielectricAxis(float eta) {
    const float ratio = clamp(2.0 * (eta - 1.0) / (eta + 1.0), -1.0, 1.0);
    return 0.5 + 0.5 * sign(ratio) * pow(abs(ratio), 1.0 / 3.0);
}

// Energy that a rough dielectric neither reflects nor refracts; eta: index beyond over index before.
float dielectricLoss(float cosTheta, float roughness, float eta) {
    vec3 f;
    const uint x = tableNode(sqrt(cosTheta), kDielectricSize, f.x);
    const uint y = tableNode(roughness, kDielectricSize, f.y);
    const uint z = tableNode(dielectricAxis(eta), kDielectricEtas, f.z);
    const uint slice = kDielectricSize * kDielectricSize;
    const uint i = kDielectricOffset + z * slice + y * kDielectricSize + x;
    const vec4 corners = mix(unpackUnorm4x8(TL_BSDF_TABLES.v[i]), unpackUnorm4x8(TL_BSDF_TABLES.v[i + slice]), f.z);
    const vec2 row = mix(corners.xz, corners.yw, f.x);
    return mix(row.x, row.y, f.y);
}

float dielectricLossMean(float roughness, float eta) {
    vec2 f;
    const uint y = tableNode(roughness, kDielectricSize, f.x);
    const uint z = tableNode(dielectricAxis(eta), kDielectricEtas, f.y);
    const uint i = kDielectricMeanOffset + z * kDielectricSize + y;
    return mix(mix(bsdfTableFloat(i), bsdfTableFloat(i + 1u), f.x),
               mix(bsdfTableFloat(i + kDielectricSize), bsdfTableFloat(i + kDielectricSize + 1u), f.x), f.y);
}

#endif
