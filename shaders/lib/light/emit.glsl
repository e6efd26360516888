// Light leaving a light: where light subpaths and photons start, and how likely they are to start there.
//
// Finite lights: a point by area (a texture's share of it by luminance), then a direction by cosine about its normal, so
// that the weight L cos / (pdfPosition pdfDirection) is pi L area, or pi times the texture's mean. Lights at infinity: the
// direction as lightSample chooses it, then a point of the disk across it that covers the scene's bounding sphere.
#ifndef TL_LIB_LIGHT_EMIT_GLSL
#define TL_LIB_LIGHT_EMIT_GLSL

#include "lib/light/light.glsl"
#include "lib/light/local.glsl"

struct EmittedRay {
    vec3 origin;        // on the light; infinite: on the disk, outside the scene
    vec3 normal;        // unit, on the emitting side; infinite: the direction
    vec3 direction;     // unit, away from the light
    vec2 uv;            // light-local; dome: texture coordinates
    vec3 radiance;      // W/(m^2 sr) along the direction; delta: irradiance across it, W/m^2
    float pdfPosition;  // by area, without the choice of the light; infinite: on the disk
    float pdfDirection; // by solid angle; delta: 1
    bool delta;         // only this direction
    bool infinite;
};

struct EmitPoint {
    vec3 position;
    vec3 normal; // unit, on the emitting side
    vec2 uv;     // light-local (lib/light/local.glsl)
    float pdfArea;
};

// Area of the world over that of the round shape at unit world normal n, from the cofactor of the map between them:
// for n = N / |N| with N the inverse transpose applied to the local normal, |N| = 1 / |transpose applied to n|.
float areaJacobian(LightFrame f, vec3 normal) {
    return f.scale * f.scale * (f.determinant / length(normal * f.worldFromLocal));
}

// ---- Position: finite lights --------------------------------------------------------------------

// Density by area of lightEmitPoint at a point of the light with this normal and these coordinates.
float lightEmitPdfArea(Light light, DistributionRef distributions, vec3 normal, vec2 uv) {
    float pdf = 1.0 / light.area;
    if (lightIs(light, kLightRect)) {
        if (lightIsDistributed(light)) pdf *= distributionPdf(distributions.v[light.distribution], uv);
    } else if (lightIs(light, kLightSphere)) {
        pdf = kInvFourPi / areaJacobian(sphereFrame(light, light.position), normal);
    } else if (lightIs(light, kLightCylinder)) {
        const LightFrame f = cylinderFrame(light, light.position);
        pdf = kInvTwoPi * f.scale / (length(light.axisU) * areaJacobian(f, normal));
    }
    return isFinite(pdf) ? pdf : 0.0;
}

// The place `uv`; pdfArea is that of a density of 1 per uv.
EmitPoint lightEmitPointAt(Light light, vec2 uv) {
    EmitPoint p;
    float area, scale;
    p.position = light.position + surfacePoint(light, uv, p.normal, area, scale);
    p.uv = uv;
    p.pdfArea = safeDivide(1.0, area * scale * scale);
    return p;
}

// u in [0,1)^2.
EmitPoint lightEmitPoint(Light light, DistributionRef distributions, vec2 u) {
    EmitPoint p = EmitPoint(light.position, light.normal, vec2(0.0), 0.0);
    if (lightIs(light, kLightRect)) {
        vec2 edges = u;
        if (lightIsDistributed(light))
            edges = rectTextureFromEdges(sampleDistribution(distributions.v[light.distribution], u)); // its own inverse
        p.position += (edges.x - 0.5) * light.axisU + (edges.y - 0.5) * light.axisV;
        p.uv = rectTextureFromEdges(edges);
    } else if (lightIs(light, kLightDisk)) {
        p.uv = sampleDisk(u);
        p.position += p.uv.x * light.axisU + p.uv.y * light.axisV;
    } else if (lightIs(light, kLightTriangle)) {
        p.uv = sampleTriangle(u);
        p.position += p.uv.x * light.axisU + p.uv.y * light.axisV;
    } else if (lightIs(light, kLightSphere)) {
        const LightFrame f = sphereFrame(light, light.position);
        const vec3 local = sampleSphere(u);
        p.position += f.scale * (f.worldFromLocal * local);
        p.normal = normalize(local * f.localFromWorld);
        p.uv = octahedralEncode(local);
    } else if (lightIs(light, kLightCylinder)) {
        const LightFrame f = cylinderFrame(light, light.position);
        const vec3 local = vec3(0.0, accurateCosSin(kTwoPi * (u.y - 0.5)));
        p.position += (u.x - 0.5) * light.axisU + f.scale * (f.worldFromLocal * local);
        p.normal = normalize(local * f.localFromWorld);
        p.uv = u;
    }
    p.pdfArea = lightEmitPdfArea(light, distributions, p.normal, p.uv);
    return p;
}

// ---- Direction ----------------------------------------------------------------------------------

// Density by solid angle of lightEmitDirection; 1 for the one direction of a delta light.
float lightEmitPdfDirection(Light light, DistributionRef distributions, vec3 normal, vec3 direction) {
    if (lightIs(light, kLightDome)) return domePdf(light, distributions, -direction);
    if (lightIs(light, kLightDistant)) return light.radius > 0.0 ? distantPdf(light, -direction) : 1.0;
    return pdfSolidAngleCosineHemisphere(dot(normal, direction));
}

// Unit, away from the light; `normal` is that of the point, not used for lights at infinity.
vec3 lightEmitDirection(Light light, DistributionRef distributions, vec3 normal, vec2 u) {
    if (lightIs(light, kLightDome)) return -domeSample(light, distributions, u).wi;
    if (lightIs(light, kLightDistant)) return -distantSample(light, u).wi;
    return basisAround(normal) * sampleCosineHemisphere(u);
}

// ---- Both ---------------------------------------------------------------------------------------

// Density of the disk that stands for the position of a light at infinity.
float emitDiskPdf(float boundsRadius) { return safeDivide(kInvPi, boundsRadius * boundsRadius); }

// The ray from `point` (finite lights) or from the disk at u (infinite ones) along `direction`, which had density
// pdfDirection: that of lightEmitDirection, or of whatever guides emission.
EmittedRay emittedRay(Light light, EmitPoint point, vec3 direction, float pdfDirection, vec3 boundsCenter,
                      float boundsRadius, vec2 u) {
    EmittedRay ray;
    ray.direction = direction;
    ray.infinite = lightIsInfinite(light);
    ray.delta = lightIs(light, kLightDistant) && light.radius <= 0.0;
    ray.origin = point.position;
    ray.normal = point.normal;
    ray.uv = point.uv;
    ray.pdfPosition = point.pdfArea;
    if (ray.infinite) {
        ray.origin = boundsCenter + boundsRadius * (basisAround(direction) * vec3(sampleDisk(u), -1.0));
        ray.normal = direction;
        ray.uv = lightUv(light, ray.origin, -direction);
        ray.pdfPosition = emitDiskPdf(boundsRadius);
    }
    ray.radiance = lightIs(light, kLightDistant) ? light.radiance : lightRadiance(light, -direction, ray.uv);
    ray.pdfDirection = pdfDirection;
    return ray;
}

// One ray of the light; its flux is radiance * dot(normal, direction) / (pdfPosition * pdfDirection), nothing where either
// density is 0.
EmittedRay lightEmit(Light light, DistributionRef distributions, vec3 boundsCenter, float boundsRadius, vec2 uPosition,
                     vec2 uDirection) {
    EmitPoint point = EmitPoint(vec3(0.0), vec3(0.0), vec2(0.0), 0.0);
    if (!lightIsInfinite(light)) point = lightEmitPoint(light, distributions, uPosition);
    const vec3 direction = lightEmitDirection(light, distributions, point.normal, uDirection);
    const float pdf = lightEmitPdfDirection(light, distributions, point.normal, direction);
    return emittedRay(light, point, direction, pdf, boundsCenter, boundsRadius, uPosition);
}

#endif
