// Choosing a light and a point on it, and the radiance and pdf of lights that rays run into.
#ifndef TL_SCENE_LIGHTS_GLSL
#define TL_SCENE_LIGHTS_GLSL

#include "lib/light/light.glsl"
#include "scene/bindings.glsl"
#include "scene/surface.glsl"

// Incident light from one sampled point: radiance / pdfSolidAngle estimates the integral over all lights' directions.
struct DirectSample {
    vec3 wi;
    float distance;
    vec3 radiance;
    float pdfSolidAngle; // includes the choice of the light; 0: nothing
    bool delta;          // wi is the only direction: never met by a BSDF sample; pdfSolidAngle is the choice's alone
    uint light;
};

// Alias method; `u` in [0,1).
uint chooseLight(float u) {
    const float scaled = u * float(TL_SCENE.lightCount);
    const uint i = min(uint(scaled), TL_SCENE.lightCount - 1u);
    const AliasEntry entry = TL_SCENE.lightAlias.v[i];
    return scaled - float(i) < entry.threshold ? i : entry.alias;
}

// Emission of a textured emissive triangle varies over it: ask the material at the sampled point.
vec3 triangleRadiance(Light light, vec2 barycentrics) {
    Hit hit;
    hit.instance = light.instance;
    hit.primitive = light.image;
    hit.uv = barycentrics;
    const Surface s = loadSurface(hit);
    return loadEmission(TL_SCENE.materials.v[s.material], s, 0.0);
}

// One light by the alias table, one direction towards it. u.z chooses the light.
DirectSample sampleDirect(vec3 position, vec3 u) {
    DirectSample d;
    d.pdfSolidAngle = 0.0;
    d.light = chooseLight(u.z);
    const Light light = TL_SCENE.lights.v[d.light];
    const LightSample s = lightSample(light, TL_SCENE.distributions, position, u.xy);
    d.wi = s.wi;
    d.distance = s.distance;
    d.radiance = s.radiance;
    d.delta = s.delta;
#if TL_TEXTURES
    if (light.kind == kLightTriangle && light.image != kNone && s.pdfSolidAngle > 0.0)
        d.radiance = triangleRadiance(light, s.uv);
#endif
    d.pdfSolidAngle = s.pdfSolidAngle * light.selection;
    return d;
}

// The paper divides by the density on the light but not by the probability of having chosen it: with N equal lights its
// picture is N times too dark. Kept reproducible as light.selection = uncompensated.
float uncompensatedPdf(DirectSample d) { return d.pdfSolidAngle / TL_SCENE.lights.v[d.light].selection; }

// Radiance that surface `s` emits towards `wo` (unit, away from the surface).
vec3 surfaceEmission(Surface s, vec3 wo, float footprint) {
    if (s.light != kNone) {
        const Light light = TL_SCENE.lights.v[s.light];
        if (light.kind != kLightTriangle) return lightRadiance(light, -wo, lightUv(light, s.position, -wo));
    }
    const Material m = TL_SCENE.materials.v[s.material];
    if ((m.flags & kMaterialEmissive) == 0u || dot(s.geometricNormal, wo) <= 0.0) return vec3(0.0);
    return loadEmission(m, s, footprint);
}

// Density with which sampleDirect at `from` makes the direction `wi` to the emitting surface point `s`.
float directPdfSolidAngle(vec3 from, Surface s, vec3 wi) {
    if (s.light == kNone) return 0.0;
    const Light light = TL_SCENE.lights.v[s.light];
    return light.selection * lightPdfSolidAngle(light, TL_SCENE.distributions, from, s.position, wi);
}

// Lights at infinity stand first in the table. Radiance that comes from direction `wi`, each weighted by
// weight(density) where `density` is that of sampleDirect for this light; `nee` false: weight 1.
vec3 environmentRadiance(vec3 from, vec3 wi, float pdfBsdf, bool weighted) {
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < TL_SCENE.infiniteLightCount; ++i) {
        const Light light = TL_SCENE.lights.v[i];
        const vec3 radiance = lightRadiance(light, wi, lightUv(light, from, wi));
        if (maxComponent(radiance) <= 0.0) continue;
        float weight = 1.0;
        if (weighted) {
            const float pdf = light.selection * lightPdfSolidAngle(light, TL_SCENE.distributions, from, from, wi);
            weight = powerHeuristic(pdfBsdf, pdf);
        }
        sum += weight * radiance;
    }
    return sum;
}

#endif
