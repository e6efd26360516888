// Places on lights that mean the same to every receiver and in every frame, however the light moves, turns or scales.
// Reservoirs hold them; a density "per uv" is with respect to du dv, but for spheres and domes, where it is per solid angle
// of the local direction, which has no poles.
//   triangle   barycentrics of corners 1 and 2      rect       texture coordinates
//   disk       local x and y                        cylinder   place along the axis, turn about it
//   sphere     octahedral map of the local normal   dome       the same of the local direction
//   distant    as sampleCone takes them; of angle 0: none, and densities are probabilities
#ifndef TL_LIB_LIGHT_LOCAL_GLSL
#define TL_LIB_LIGHT_LOCAL_GLSL

#include "lib/light/light.glsl"
#include "lib/octahedral.glsl"

// Of unit direction wi towards a light at infinity.
vec2 infiniteLocalUv(Light light, vec3 wi) {
    if (lightIs(light, kLightDome))
        return octahedralEncode(vec3(dot(wi, light.axisU), dot(wi, light.axisV), dot(wi, light.normal)));
    if (light.radius <= 0.0) return vec2(0.0);
    const vec2 across = (wi * basisAround(-light.normal)).xy;
    const float turn = accurateAtan2(across.y, across.x) * kInvTwoPi;
    return vec2(min(0.5 * lengthSquared(wi + light.normal) / light.radius, 1.0), turn < 0.0 ? turn + 1.0 : turn);
}

// Of a point that lightSample made.
vec2 lightLocalUv(Light light, LightSample s) { return lightIsInfinite(light) ? infiniteLocalUv(light, s.wi) : s.uv; }

LightSample infiniteSampleAt(Light light, vec2 uv) {
    LightSample s = kNoLight;
    s.distance = kLightAtInfinity;
    s.pdfSolidAngle = 1.0;
    if (lightIs(light, kLightDome)) {
        const vec3 w = octahedralDecode(uv);
        s.wi = normalize(w.x * light.axisU + w.y * light.axisV + w.z * light.normal);
        s.uv = domeUv(light, s.wi);
        s.radiance = lightRadiance(light, s.wi, s.uv);
    } else {
        s.delta = light.radius <= 0.0;
        s.wi = s.delta ? -light.normal : basisAround(-light.normal) * sampleCone(uv, light.radius);
        s.radiance = light.radiance;
        if (!s.delta) s.pdfSolidAngle = pdfSolidAngleCone(light.radius);
    }
    s.normal = -s.wi;
    return s;
}

vec3 outward(vec3 areaVector, vec3 fromCenter, out float area) {
    area = length(areaVector);
    return areaVector / (dot(areaVector, fromCenter) < 0.0 ? -area : area);
}

// From the light's position to the point, with the outward normal; area: |dA / duv| / scale^2.
vec3 surfacePoint(Light light, vec2 uv, out vec3 normal, out float area, out float scale) {
    scale = 1.0;
    normal = light.normal;
    area = light.area;
    if (lightIs(light, kLightSphere)) {
        scale = light.radius;
        const vec3 n = octahedralDecode(uv);
        const vec3 u = light.axisU / scale, v = light.axisV / scale, w = light.normal;
        const vec3 point = n.x * u + n.y * v + n.z * w;
        normal = outward(n.x * cross(v, w) + n.y * cross(w, u) + n.z * cross(u, v), point, area);
        return scale * point;
    }
    if (lightIs(light, kLightCylinder)) {
        scale = light.radius;
        const vec2 cosSin = accurateCosSin((uv.y - 0.5) * kTwoPi);
        const vec3 v = light.axisV / scale, w = light.normal;
        const vec3 radial = cosSin.x * v + cosSin.y * w;
        normal = outward(kTwoPi * cross(light.axisU / scale, cosSin.x * w - cosSin.y * v), radial, area);
        return (uv.x - 0.5) * light.axisU + scale * radial;
    }
    if (lightIs(light, kLightRect)) uv = rectTextureFromEdges(uv) - 0.5;
    else if (lightIs(light, kLightDisk)) area *= kInvPi;
    else area *= 2.0;
    return uv.x * light.axisU + uv.y * light.axisV;
}

// The place `uv` as `position` sees it. pdfSolidAngle is that of a density of 1 per uv: |duv / d(solid angle)|.
LightSample lightSampleAt(Light light, vec3 position, vec2 uv) {
    if (lightIsInfinite(light)) return infiniteSampleAt(light, uv);
    LightSample s = kNoLight;
    float area, scale;
    const vec3 toPoint = light.position - position + surfacePoint(light, uv, s.normal, area, scale);
    s.distance = length(toPoint);
    s.wi = toPoint / s.distance;
    s.uv = uv;
    const float cosLight = -dot(s.wi, s.normal);
    const float d = s.distance / scale;
    s.pdfSolidAngle = d / area * (d / cosLight);
    if (!(cosLight > 0.0) || !isFinite(s.pdfSolidAngle)) return kNoLight;
    s.radiance = lightRadiance(light, s.wi, uv);
    return s;
}

#endif
