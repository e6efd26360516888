// Next-event estimation's view of lights: a direction towards one light, its density, and what the light emits.
// Everything is scale-free: receivers near, far or on a light's plane, lights of any size.
#ifndef TL_LIB_LIGHT_LIGHT_GLSL
#define TL_LIB_LIGHT_LIGHT_GLSL

#include "lib/light/curved.glsl"
#include "lib/light/infinite.glsl"
#include "lib/light/planar.glsl"
#include "lib/light/sample.glsl"

// Emitted radiance, W/(m^2 sr), seen when looking along unit wi (from the receiver to the light); 0 on the back of planar
// lights, outside a distant light's cone, and for a distant light of angle 0. Spheres and cylinders emit outward: their
// inside is for the caller to tell by the surface's normal. `uv`: lightUv at the point seen.
vec3 lightRadiance(Light light, vec3 wi, vec2 uv) {
    switch (light.kind) {
    case kLightRect:
    case kLightDisk:
    case kLightTriangle:
        if (dot(wi, light.normal) >= 0.0) return vec3(0.0);
        break;
    case kLightDistant:
        if (!inDistantCone(light, wi)) return vec3(0.0);
        break;
    }
    const bool textured = (light.kind == kLightRect || light.kind == kLightDome) && light.image != kNone;
    return textured ? light.radiance * TL_SAMPLE_TEXTURE(light.image, uv) : light.radiance;
}

// Texture coordinates of `point` on a rectangle or of direction wi in a dome, (0,0) the picture's lower left corner;
// barycentrics of corners 1 and 2 of a triangle; 0 for other kinds.
vec2 lightUv(Light light, vec3 point, vec3 wi) {
    switch (light.kind) {
    case kLightRect: return rectUv(light, point);
    case kLightDome: return domeUv(light, wi);
    case kLightTriangle: return planarCoordinates(point - light.position, light.axisU, light.axisV);
    }
    return vec2(0.0);
}

// A direction from `position` towards the light, without the probability of having chosen the light. u in [0,1)^2.
LightSample lightSample(Light light, DistributionRef distributions, vec3 position, vec2 u) {
    LightSample s = kNoLight;
    switch (light.kind) {
    case kLightRect: s = rectSample(light, distributions, position, u); break;
    case kLightDisk: s = diskSample(light, position, u); break;
    case kLightSphere: s = sphereSample(light, position, u); break;
    case kLightCylinder: s = cylinderSample(light, position, u); break;
    case kLightDistant: s = distantSample(light, u); break;
    case kLightDome: s = domeSample(light, distributions, u); break;
    case kLightTriangle: s = triangleSample(light, position, u); break;
    }
    if (!(s.pdfSolidAngle > 0.0) || !isFinite(s.pdfSolidAngle) || !isFinite(s.wi)) return kNoLight;
    if (light.kind != kLightDistant) s.radiance = lightRadiance(light, s.wi, s.uv);
    return s;
}

// Density with which lightSample at `from` makes unit direction wi, which meets the light at `point` (not used for lights
// at infinity); 0 for directions that it never makes. The caller has made sure that wi meets the emitting side.
float lightPdfSolidAngle(Light light, DistributionRef distributions, vec3 from, vec3 point, vec3 wi) {
    float pdf = 0.0;
    switch (light.kind) {
    case kLightRect: pdf = rectPdf(light, distributions, from, point, wi); break;
    case kLightDisk: pdf = diskPdf(light, from, point, wi); break;
    case kLightSphere: pdf = spherePdf(light, from, wi); break;
    case kLightCylinder: pdf = cylinderPdf(light, from, wi); break;
    case kLightDistant: pdf = distantPdf(light, wi); break;
    case kLightDome: pdf = domePdf(light, distributions, wi); break;
    case kLightTriangle: pdf = trianglePdf(light, from, wi); break;
    }
    return isFinite(pdf) ? pdf : 0.0;
}

// Vose's alias method with 32 random bits: their product with `count` is the entry (upper word) and the fraction that is
// held against its threshold (lower word), so that large tables keep exact probabilities.
uint lightSelect(AliasEntryRef table, uint count, uint bits) {
    uint entry, fraction;
    umulExtended(bits, count, entry, fraction);
    const AliasEntry e = table.v[entry];
    return float(fraction) < e.threshold * 4294967296.0 ? entry : e.alias;
}

#endif
