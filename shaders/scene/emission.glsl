// Rays that leave the scene's lights: where light subpaths and photons start.
#ifndef TL_SCENE_EMISSION_GLSL
#define TL_SCENE_EMISSION_GLSL

#include "scene/bindings.glsl"

#include "lib/light/emit.glsl"
#include "lib/ray_offset.glsl"
#include "scene/lights.glsl"

// Where the material makes emission vary, its own takes the place of the light's mean.
void applyMaterialEmission(Light light, inout EmittedRay ray) {
#if TL_TEXTURES || TL_CUTOUTS
    if (emissionVaries(light)) ray.radiance = hitEmission(Hit(0.0, light.instance, light.image, ray.uv));
#endif
}

// One ray of the light; pdfPosition and pdfDirection are without the choice of the light.
EmittedRay sampleEmission(Light light, inout Sampler rng) {
    const vec2 u = sample2D(rng);
    EmittedRay ray = lightEmit(light, TL_SCENE.distributions, TL_SCENE.boundsCenter, TL_SCENE.boundsRadius, u,
                               sample2D(rng));
    applyMaterialEmission(light, ray);
    return ray;
}

// A ray from the place `uv` of the light (lib/light/local.glsl), its direction or, for lights at infinity, its position
// drawn; the densities are those of a density of 1 per uv.
EmittedRay sampleEmissionAt(Light light, vec2 uv, inout Sampler rng) {
    EmitPoint point = EmitPoint(vec3(0.0), vec3(0.0), vec2(0.0), 0.0);
    vec3 direction;
    float pdf;
    const vec2 u = sample2D(rng);
    if (lightIsInfinite(light)) {
        const LightSample s = infiniteSampleAt(light, uv);
        direction = -s.wi;
        pdf = s.pdfSolidAngle;
    } else {
        point = lightEmitPointAt(light, uv);
        direction = lightEmitDirection(light, TL_SCENE.distributions, point.normal, u);
        pdf = lightEmitPdfDirection(light, TL_SCENE.distributions, point.normal, direction);
    }
    EmittedRay ray = emittedRay(light, point, direction, pdf, TL_SCENE.boundsCenter, TL_SCENE.boundsRadius, u);
    applyMaterialEmission(light, ray);
    return ray;
}

// Where on the light a ray left it (lib/light/local.glsl).
vec2 emissionLocalUv(Light light, EmittedRay ray) {
    return lightIsInfinite(light) ? infiniteLocalUv(light, -ray.direction) : ray.uv;
}

// Density of a ray of the light by position and direction, the choice of the light included, where it leaves `point` with
// this normal; both are not used for lights at infinity.
float emissionPdf(Light light, vec3 point, vec3 normal, vec3 direction) {
    const float pdfPosition =
        lightIsInfinite(light) ? emitDiskPdf(TL_SCENE.boundsRadius)
                               : lightEmitPdfArea(light, TL_SCENE.distributions, normal, lightUv(light, point, -direction));
    return light.selection * pdfPosition * lightEmitPdfDirection(light, TL_SCENE.distributions, normal, direction);
}

// Where a ray of the light starts so that the light's own surface doesn't stop it.
vec3 emissionOrigin(Light light, EmittedRay ray) {
    return ray.infinite ? ray.origin : offsetRayOrigin(ray.origin, ray.normal, lightExtent(light));
}

#endif
