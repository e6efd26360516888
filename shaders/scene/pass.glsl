// What every per-pixel pass begins and ends with.
#ifndef TL_SCENE_PASS_GLSL
#define TL_SCENE_PASS_GLSL

#extension GL_KHR_shader_subgroup_arithmetic : require

#include "lib/rng.glsl"
#include "scene/bindings.glsl"

// Groups of passes over pixels. Squares keep rays together, and so do the eight lanes of a CPU, which are of one row either
// way: there eight rows of every plane lie on more pages than the TLB holds.
#ifdef TL_CPU
#define TL_PIXEL_GROUP local_size_x = 32, local_size_y = 1
#else
#define TL_PIXEL_GROUP local_size_x = 8, local_size_y = 8
#endif

bool insideView(uvec2 pixel) { return pixel.x < TL_FRAME.width && pixel.y < TL_FRAME.height; }
uint pixelIndex(uvec2 pixel) { return pixel.y * TL_FRAME.width + pixel.x; }

Sampler pixelSampler(uvec2 pixel) {
    const uint kind = (TL_FRAME.flags & kFrameSobol) != 0u ? kSamplerSobol : kSamplerIndependent;
    return samplerInit(pixel, TL_FRAME.frameIndex, TL_FRAME.seed, kind);
}

// This group's part of work of which only the first parts hold any, where the number of groups is a multiple of kGroupSpread:
// devices of few cores give each a run of successive groups.
uint spreadGroup() {
    return gl_WorkGroupID.x % kGroupSpread * (gl_NumWorkGroups.x / kGroupSpread) + gl_WorkGroupID.x / kGroupSpread;
}

void countRays(uint rays) {
    const uint sum = subgroupAdd(rays);
    if (subgroupElect()) atomicAdd(TL_FRAME.counters.v[kCounterRays], sum);
}

#endif
