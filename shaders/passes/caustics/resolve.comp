// This frame's photons enter the cache's mean.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/push.glsl"
#include "scene/caustic_cache.glsl"

layout(local_size_x = 64) in;

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= kCausticPatches || push.cache.v[index].key == 0u) return;
    push.cache.v[index].irradiance =
        mix(push.cache.v[index].irradiance, takeSum(push.cacheSums, index), push.cacheShare);
    const float landed = float(push.cacheCounts.v[index]) / float(max(push.state.v[0].emitted, 1u));
    push.cacheCounts.v[index] = 0u;
    push.cache.v[index].density = mix(push.cache.v[index].density, landed / causticPatchArea(), push.cacheShare);
}
