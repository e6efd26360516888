// Lights at infinity: distant (a cone of directions) and dome (a latitude-longitude picture of all of them).
#ifndef TL_LIB_LIGHT_INFINITE_GLSL
#define TL_LIB_LIGHT_INFINITE_GLSL

#include "lib/light/distribution.glsl"
#include "lib/light/numeric.glsl"
#include "lib/light/sample.glsl"
#include "lib/sampling.glsl"

LightSample distantSample(Light light, vec2 u) {
    const bool delta = light.radius <= 0.0;
    const vec3 wi = delta ? -light.normal : basisAround(-light.normal) * sampleCone(u, light.radius);
    return LightSample(wi, kLightAtInfinity, light.radiance, delta ? 1.0 : pdfSolidAngleCone(light.radius), delta, -wi,
                       vec2(0.0));
}

// |wi + normal|^2 = 2 (1 - cos), which keeps narrow cones apart where a cosine would round to 1.
bool inDistantCone(Light light, vec3 wi) {
    return light.radius > 0.0 && lengthSquared(wi + light.normal) <= 2.0 * light.radius;
}

float distantPdf(Light light, vec3 wi) { return inDistantCone(light, wi) ? pdfSolidAngleCone(light.radius) : 0.0; }

// OpenEXR's latitude-longitude map, as UsdLux asks: the picture's centre is local +z, its left half +x, its top +y.
vec2 domeUv(Light light, vec3 wi) {
    const vec3 w = vec3(dot(wi, light.axisU), dot(wi, light.axisV), dot(wi, light.normal));
    const float longitude = accurateAtan2(w.x, w.z);
    const float latitude = accurateAtan2(w.y, length(w.xz));
    return vec2(0.5 - longitude * kInvTwoPi, 0.5 + latitude * kInvPi);
}

vec3 domeDirection(Light light, vec2 uv) {
    const float longitude = (0.5 - uv.x) * kTwoPi, latitude = (uv.y - 0.5) * kPi;
    const vec3 w = vec3(cos(latitude) * sin(longitude), sin(latitude), cos(latitude) * cos(longitude));
    return normalize(w.x * light.axisU + w.y * light.axisV + w.z * light.normal);
}

// du dv = d(solid angle) / (2 pi^2 cos latitude).
float domePdfAt(Light light, DistributionRef distributions, vec3 wi, vec2 uv) {
    const float sinLatitude = dot(wi, light.axisV);
    const float cosLatitude = safeSqrt((1.0 - sinLatitude) * (1.0 + sinLatitude));
    return safeDivide(distributionPdf(distributions.v[light.distribution], uv), 2.0 * kPi * kPi * cosLatitude);
}

float domePdf(Light light, DistributionRef distributions, vec3 wi) {
    if (!lightIsDistributed(light)) return pdfSolidAngleSphere();
    return domePdfAt(light, distributions, wi, domeUv(light, wi));
}

LightSample domeSample(Light light, DistributionRef distributions, vec2 u) {
    if (!lightIsDistributed(light)) {
        const vec3 wi = sampleSphere(u);
        return LightSample(wi, kLightAtInfinity, light.radiance, pdfSolidAngleSphere(), false, -wi, domeUv(light, wi));
    }
    const vec2 uv = sampleDistribution(distributions.v[light.distribution], u);
    const vec3 wi = domeDirection(light, uv);
    return LightSample(wi, kLightAtInfinity, light.radiance, domePdfAt(light, distributions, wi, uv), false, -wi, uv);
}

#endif
