// Choosing a light and a point on it, and the radiance and pdf of lights that rays run into.
#ifndef TL_SCENE_LIGHTS_GLSL
#define TL_SCENE_LIGHTS_GLSL

#include "scene/bindings.glsl"

#include "lib/light/light.glsl"
#include "lib/light/local.glsl"
#include "lib/mis.glsl"
#include "lib/rng.glsl"
#include "scene/surface.glsl"

const uint kNearbyCandidates = 8u;

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
    vec2 uv;             // of the sampled point, light-local (lib/light/local.glsl)
};

// Whether textures or cut-outs make a light's emission vary: then its material knows.
bool emissionVaries(Light light) {
    return light.image != kNone && (lightIs(light, kLightTriangle) || lightIs(light, kLightSphere));
}

// Emission at a completed hit, times the share of rays that meet the surface there.
vec3 hitEmission(Hit hit) {
    const Surface emitter = loadSurface(hit);
    const Material m = TL_SCENE.materials.v[emitter.material];
    const float opacity = (m.flags & kMaterialCutout) != 0u ? loadOpacity(m, emitter, 0.0) : 1.0;
    return opacity * loadEmission(m, emitter, 0.0);
}

// Bound on the light's coordinates about its position, for ray offsets.
float lightExtent(Light light) { return maxComponent(abs(light.axisU) + abs(light.axisV)) + light.radius; }

DirectSample directSample(uint index, Light light, LightSample s) {
    DirectSample d;
    d.light = index;
    d.uv = lightLocalUv(light, s);
    d.wi = s.wi;
    d.distance = s.distance;
    d.radiance = s.radiance;
    d.delta = s.delta;
    d.normal = s.normal;
    d.extent = lightExtent(light);
#if TL_TEXTURES || TL_CUTOUTS
    if (emissionVaries(light) && s.pdfSolidAngle > 0.0)
        d.radiance = hitEmission(Hit(s.distance, light.instance, light.image, s.uv));
#endif
    d.pdfSolidAngle = s.pdfSolidAngle;
    return d;
}

// One direction towards a given light; pdfSolidAngle leaves out the choice.
DirectSample sampleLight(vec3 position, uint index, vec2 u) {
    const Light light = TL_SCENE.lights.v[index];
    return directSample(index, light, lightSample(light, TL_SCENE.distributions, position, u));
}

// One light by the alias table, one direction towards it.
DirectSample sampleDirect(vec3 position, inout Sampler rng) {
    const uint index = lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, sampleBits(rng));
    DirectSample d = sampleLight(position, index, sample2D(rng));
    d.pdfSolidAngle *= TL_SCENE.lights.v[index].selection;
    return d;
}

// What share of a light's power a surface may get, up to a factor that is the same for all: a guess that is never 0.
float lightReach(Light light, vec3 position, vec3 normal) {
    if (lightIsInfinite(light)) return 1.0 / sqr(TL_SCENE.boundsRadius);
    vec3 way = light.position - position;
    if (lightIs(light, kLightTriangle)) way += (light.axisU + light.axisV) / 3.0;
    const float extent = lightExtent(light);
    const float distance = max(length(way), extent);
    float cosines = clamp((dot(way, normal) + extent) / distance, 0.05, 1.0);
    if (lightIs(light, kLightSphere) || lightIs(light, kLightCylinder)) cosines *= 0.25; // they shine to all sides
    else cosines *= clamp((extent - dot(way, light.normal)) / distance, 0.05, 1.0);
    return cosines / sqr(distance);
}

// Like sampleDirect, with the light resampled from several by what they may bring to a surface with this normal: an estimate
// as unbiased, whose pdfSolidAngle is the reciprocal of the contribution weight (Talbot et al. 2005).
DirectSample sampleNearbyDirect(vec3 position, vec3 normal, inout Sampler rng) {
    const bool several = TL_SCENE.lightCount > 1u && (TL_FRAME.flags & kFrameUncompensated) == 0u;
    const uint candidates = several ? kNearbyCandidates : 1u;
    float sum = 0.0, chosenReach = 0.0;
    uint chosen = 0u;
    for (uint i = 0u; i < candidates; ++i) {
        const uint index = lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, sampleBits(rng));
        const float reach = lightReach(TL_SCENE.lights.v[index], position, normal);
        sum += reach;
        if (sample1D(rng) * sum < reach) {
            chosen = index;
            chosenReach = reach;
        }
    }
    DirectSample d = sampleLight(position, chosen, sample2D(rng));
    d.pdfSolidAngle *= TL_SCENE.lights.v[chosen].selection * float(candidates) * chosenReach / sum;
    return d;
}

// A given place on a given light. pdfSolidAngle is that of a density of 1 per uv: radiance / pdfSolidAngle is to be
// multiplied by an unbiased contribution weight per uv.
DirectSample directSampleAt(vec3 position, uint index, vec2 uv) {
    const Light light = TL_SCENE.lights.v[index];
    return directSample(index, light, lightSampleAt(light, position, uv));
}

// Light-local coordinates of a completed hit on the light's surface.
vec2 lightUvOfHit(Light light, Hit hit) { return lightIs(light, kLightRect) ? rectTextureFromEdges(hit.uv) : hit.uv; }

// The paper divides by the density on the light but not by the probability of having chosen it: with N equal lights its
// picture is N times too dark. Kept reproducible as light.selection = uncompensated.
float uncompensatedPdf(DirectSample d) { return d.pdfSolidAngle / TL_SCENE.lights.v[d.light].selection; }

// Radiance that surface `s` emits towards `wo` (unit, away from the surface).
vec3 surfaceEmission(Surface s, vec3 wo, float footprint) {
    if (dot(s.geometricNormal, wo) <= 0.0) return vec3(0.0);
    const Material m = TL_SCENE.materials.v[s.material];
    if ((m.flags & kMaterialEmissive) != 0u) return loadEmission(m, s, footprint);
    if (s.light == kNone) return vec3(0.0);
    const Light light = TL_SCENE.lights.v[s.light];
    return lightRadiance(light, -wo, lightUv(light, s.position, -wo));
}

// Density with which sampleLight at `from` makes the direction `wi` to the emitting surface point `s` of light `index`.
float sampledLightPdf(vec3 from, uint index, Surface s, vec3 wi) {
    return lightPdfSolidAngle(TL_SCENE.lights.v[index], TL_SCENE.distributions, from, s.position, wi);
}

// Density with which sampleDirect does.
float directPdfSolidAngle(vec3 from, Surface s, vec3 wi) {
    return s.light == kNone ? 0.0 : TL_SCENE.lights.v[s.light].selection * sampledLightPdf(from, s.light, s, wi);
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
