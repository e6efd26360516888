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
