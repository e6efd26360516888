// The rays of a probe's update: tracing and blending derive the same directions from the same random numbers.
#ifndef TL_SCENE_PROBE_RAYS_GLSL
#define TL_SCENE_PROBE_RAYS_GLSL

#include "lib/probe.glsl"
#include "scene/pass.glsl"

// Rays of a probe towards photons, after its `rays` others, which tell of no surfaces.
uint photonRays(uint rays) {
#if TL_CAUSTIC_CACHE
    return max(rays / 8u, 1u);
#else
    return 0u;
#endif
}
uint probeRayStride(uint rays) { return rays + photonRays(rays); }

// Ray 0xffff stands for the probe itself.
Sampler probeSampler(uint index, uint ray, uint updates) {
    const uint kind = (TL_FRAME.flags & kFrameSobol) != 0u ? kSamplerSobol : kSamplerIndependent;
    return samplerInit(uvec2(index & 0xffffu, ray ^ index >> 16), updates, TL_FRAME.seed ^ 0x70726f62u, kind);
}

mat3 probeRayRotation(uint index, uint updates) {
    Sampler rng = probeSampler(index, 0xffffu, updates);
    return probeRotation(sample3D(rng));
}

#endif
