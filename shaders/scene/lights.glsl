// Choosing a light and a point on it, and the radiance and pdf of lights that rays run into.
#ifndef TL_SCENE_LIGHTS_GLSL
#define TL_SCENE_LIGHTS_GLSL

#include "scene/bindings.glsl"

#include "lib/light/light.glsl"
#include "lib/mis.glsl"
#include "lib/rng.glsl"
#include "scene/surface.glsl"

// Incident light from one sampled point: radiance / pdfSolidAngle estimates the integral over all lights' directions.
struct DirectSample {
    vec3 wi;
    float distance;
    vec3 radiance;
    float pdfSolidAngle; // includes the choice of the light; 0: nothing
    bool delta;          // wi is the only direction: never met by a BSDF sample; pdfSolidAngle is the choice's alone
    vec3 normal;         // of the light at the sampled point, unit
    float extent;        // of the light, for offsets
    uint light;
};

// Emission of a textured emissive triangle varies over it: ask the material at the sampled point.
vec3 triangleRadiance(Light light, vec2 barycentrics) {
    Hit hit;
    hit.instance = light.instance;
    hit.primitive = light.image;
    hit.uv = barycentrics;
    const Surface s = loadSurface(hit);
    return loadEmission(TL_SCENE.materials.v[s.material], s, 0.0);
}

// One light by the alias table, one direction towards it.
DirectSample sampleDirect(vec3 position, inout Sampler rng) {
    DirectSample d;
    d.pdfSolidAngle = 0.0;
    d.light = lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, sampleBits(rng));
    const Light light = TL_SCENE.lights.v[d.light];
    const LightSample s = lightSample(light, TL_SCENE.distributions, position, sample2D(rng));
    d.wi = s.wi;
    d.distance = s.distance;
    d.radiance = s.radiance;
    d.delta = s.delta;
    d.normal = s.normal;
    d.extent = maxComponent(abs(light.axisU) + abs(light.axisV)) + light.radius;
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
    if (dot(s.geometricNormal, wo) <= 0.0) return vec3(0.0);
    if (s.light != kNone) {
        const Light light = TL_SCENE.lights.v[s.light];
        if (light.kind != kLightTriangle) return lightRadiance(light, -wo, lightUv(light, s.position, -wo));
    }
    const Material m = TL_SCENE.materials.v[s.material];
    return (m.flags & kMaterialEmissive) != 0u ? loadEmission(m, s, footprint) : vec3(0.0);
}

// Density with which sampleDirect at `from` makes the direction `wi` to the emitting surface point `s`.
float directPdfSolidAngle(vec3 from, Surface s, vec3 wi) {
    if (s.light == kNone) return 0.0;
    const Light light = TL_SCENE.lights.v[s.light];
    return light.selection * lightPdfSolidAngle(light, TL_SCENE.distributions, from, s.position, wi);
}

// Radiance of the lights at infinity from direction `wi`; they stand first in the table. `weighted`: each times the power
// heuristic's weight of a BSDF sample of density pdfBsdf against sampleDirect at `from`.
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
