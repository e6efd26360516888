// From a ray to the first surface that is rough and does not let light through, and the light that scatters there.
#ifndef TL_SCENE_ROUGH_GLSL
#define TL_SCENE_ROUGH_GLSL

#include "scene/caustic_cache.glsl"
#include "scene/probes.glsl"
#include "scene/shading.glsl"

// Of the rough surface: 0 where it is shaded as it is. Probes keep for long what light samples seldom find in a shiny one.
#ifndef TL_LEAST_ROUGHNESS
#define TL_LEAST_ROUGHNESS 0.0
#endif

const uint kMaxChain = 32u; // specular bounces; longer chains end black

struct RoughHit {
    bool found;
    Shading shading;  // of the rough surface
    uint instance;    // whose surface it is
    vec3 throughput;  // of the chain before it; divided by the probability of having stopped there
    vec3 passed;      // direct light that rough glass on the way scatters along the ray
    float footprint;
    float distance;   // to the first surface, rough or not, metres; kFloatMax: none
    bool back;        // the first surface was met from behind
    bool specular;    // the first surface is not the rough one
};

// Direct light that a surface scatters towards wo, by one light sample.
vec3 scatteredDirect(Shading shading, inout Sampler rng) {
    return directLight(shading, sampleNearbyDirect(shading.surface.position, shading.frame[2], rng), false);
}

// Probes do not know what is behind frosted glass: the ray goes on through it, too.
RoughHit traceToRough(vec3 origin, vec3 direction, float footprint, inout Sampler rng) {
    RoughHit result;
    result.found = result.back = result.specular = false;
    result.throughput = vec3(1.0);
    result.passed = vec3(0.0);
    result.distance = kFloatMax;
    result.footprint = footprint;
    for (uint bounce = 0u; bounce <= kMaxChain; ++bounce) {
        Hit hit;
        if (!traceSurface(origin, direction, 0.0, kFloatMax, kMaskIndirect, rng, hit)) break;
        result.footprint += hit.t * TL_FRAME.camera.pixelAngle;
        const Surface s = loadSurface(hit);
        if (bounce == 0u) {
            result.distance = hit.t;
            result.back = dot(direction, s.geometricNormal) > 0.0;
        }
        result.shading = prepareShading(s, -direction, result.footprint, kTransportRadiance, TL_LEAST_ROUGHNESS);
        const float pSpecular = bsdfDeltaProbability(result.shading.bsdf);
        bool specular = pSpecular > 0.0;
        vec3 u = vec3(0.0);
        if (specular) {
            u = sample3D(rng);
            specular = u.z < pSpecular;
        }
        if (!specular) {
            const vec3 throughput = pSpecular < 1.0 ? result.throughput / (1.0 - pSpecular) : vec3(0.0);
            if (!bsdfRefractsRoughly(result.shading.bsdf)) {
                result.throughput = throughput;
                result.found = pSpecular < 1.0;
                result.instance = hit.instance;
                break;
            }
            result.passed += throughput * scatteredDirect(result.shading, rng);
            if (pSpecular == 0.0) u = sample3D(rng);
        }
        result.specular = true;
        const BsdfSample chosen = bsdfSample(result.shading.bsdf, result.shading.woLocal, u);
        if ((chosen.flags & kBsdfValid) == 0u) break;
        result.throughput *= chosen.weight;
        if (!(maxComponent(result.throughput) > 0.0)) break;
        direction = result.shading.frame * chosen.wi;
        if (!crossesRightly(result.shading, direction, (chosen.flags & kBsdfTransmission) != 0u)) break;
        origin = offsetRayOrigin(s.position, sideTowards(s, direction), s.extent);
    }
    return result;
}

// Radiance that a rough surface scatters towards wo of the light that probes know. All its lobes that are not deltas answer
// as if the light came from everywhere alike.
vec3 scatteredProbeLight(ProbeVolumeRef volumes, Shading shading, vec3 albedo) {
    if (!(maxComponent(albedo) > 0.0)) return vec3(0.0);
    const Surface s = shading.surface;
    const bool back = dot(shading.wo, s.geometricNormal) < 0.0;
    return albedo * kInvPi *
           probeIrradiance(volumes, s.position, sideTowards(s, shading.wo), shading.frame[2], shading.wo, back);
}

// What photons have left of the light that comes through mirrors and glass.
CachedCaustic causticAt(CausticPatchRef cache, RoughHit hit) {
    const Surface s = hit.shading.surface;
    return cachedCaustic(cache, hit.instance, s.position, sideTowards(s, hit.shading.wo));
}

// What the surface scatters back along the ray.
struct ScatteredLight {
    vec3 direct;         // by one light sample
    vec3 caustic;        // TL_CAUSTIC_CACHE: whether there is a cache
    float photonDensity; // CachedCaustic::density
    vec3 probes;         // that probes know
};

ScatteredLight scatteredLight(ProbeVolumeRef volumes, CausticPatchRef cache, RoughHit hit, inout Sampler rng) {
    ScatteredLight light;
    light.direct = scatteredDirect(hit.shading, rng);
    const vec3 albedo = bsdfSmoothAlbedo(hit.shading.bsdf);
#if TL_CAUSTIC_CACHE
    const CachedCaustic caustic = causticAt(cache, hit);
    light.caustic = albedo * kInvPi * caustic.irradiance;
    light.photonDensity = caustic.density;
#else
    light.caustic = vec3(0.0);
    light.photonDensity = 0.0;
#endif
    light.probes = scatteredProbeLight(volumes, hit.shading, albedo);
    return light;
}

#endif
