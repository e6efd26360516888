// Next-event estimation's view of lights: a direction towards one light, its density, and what the light emits.
// Everything is scale-free: receivers near, far or on a light's plane, lights of any size.
#ifndef TL_LIB_LIGHT_LIGHT_GLSL
#define TL_LIB_LIGHT_LIGHT_GLSL

#include "lib/light/curved.glsl"
#include "lib/light/infinite.glsl"
#include "lib/light/planar.glsl"
#include "lib/light/sample.glsl"

bool lightIsInfinite(Light light) { return lightIs(light, kLightDistant) || lightIs(light, kLightDome); }

// Emitted radiance, W/(m^2 sr), seen when looking along unit wi (from the receiver to the light); 0 on the back of planar
// lights, outside a distant light's cone, and for a distant light of angle 0. Spheres and cylinders emit outward: their
// inside is for the caller to tell by the surface's normal. `uv`: lightUv at the point seen.
vec3 lightRadiance(Light light, vec3 wi, vec2 uv) {
    const bool planar = lightIs(light, kLightRect) || lightIs(light, kLightDisk) || lightIs(light, kLightTriangle);
    if (planar && dot(wi, light.normal) >= 0.0) return vec3(0.0);
    if (lightIs(light, kLightDistant) && !inDistantCone(light, wi)) return vec3(0.0);
#if TL_LIGHT_TEXTURES
    if ((lightIs(light, kLightRect) || lightIs(light, kLightDome)) && light.image != kNone)
        return light.radiance * TL_SAMPLE_TEXTURE(light.image, uv);
#endif
    return light.radiance;
}

// Texture coordinates of `point` on a rectangle or of direction wi in a dome, (0,0) the picture's lower left corner;
// barycentrics of corners 1 and 2 of a triangle; 0 for other kinds.
vec2 lightUv(Light light, vec3 point, vec3 wi) {
    if (lightIs(light, kLightRect)) return rectUv(light, point);
    if (lightIs(light, kLightDome)) return domeUv(light, wi);
    if (lightIs(light, kLightTriangle)) return planarCoordinates(point - light.position, light.axisU, light.axisV);
    return vec2(0.0);
}

// A direction from `position` towards the light, without the probability of having chosen the light. u in [0,1)^2.
LightSample lightSample(Light light, DistributionRef distributions, vec3 position, vec2 u) {
    LightSample s = kNoLight;
    if (lightIs(light, kLightRect)) s = rectSample(light, distributions, position, u);
    else if (lightIs(light, kLightDisk)) s = diskSample(light, position, u);
    else if (lightIs(light, kLightSphere)) s = sphereSample(light, position, u);
    else if (lightIs(light, kLightCylinder)) s = cylinderSample(light, position, u);
    else if (lightIs(light, kLightDistant)) s = distantSample(light, u);
    else if (lightIs(light, kLightDome)) s = domeSample(light, distributions, u);
    else if (lightIs(light, kLightTriangle)) s = triangleSample(light, position, u);
    if (!(s.pdfSolidAngle > 0.0) || !isFinite(s.pdfSolidAngle) || !isFinite(s.wi)) return kNoLight;
    if (!lightIs(light, kLightDistant)) s.radiance = lightRadiance(light, s.wi, s.uv);
    return s;
}

// Density with which lightSample at `from` makes unit direction wi, which meets the light at `point` (not used for lights
// at infinity); 0 for directions that it never makes. The caller has made sure that wi meets the emitting side.
float lightPdfSolidAngle(Light light, DistributionRef distributions, vec3 from, vec3 point, vec3 wi) {
    float pdf = 0.0;
    if (lightIs(light, kLightRect)) pdf = rectPdf(light, distributions, from, point, wi);
    else if (lightIs(light, kLightDisk)) pdf = diskPdf(light, from, point, wi);
    else if (lightIs(light, kLightSphere)) pdf = spherePdf(light, from, wi);
    else if (lightIs(light, kLightCylinder)) pdf = cylinderPdf(light, from, wi);
    else if (lightIs(light, kLightDistant)) pdf = distantPdf(light, wi);
    else if (lightIs(light, kLightDome)) pdf = domePdf(light, distributions, wi);
    else if (lightIs(light, kLightTriangle)) pdf = trianglePdf(light, from, wi);
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
