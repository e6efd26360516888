// Empties what the frame's photons add to: splats, grid, cache.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/push.glsl"

layout(local_size_x = 64) in;

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index < TL_FRAME.width * TL_FRAME.height)
        for (uint i = 0u; i < kFixedWords; ++i) push.splats.v[kFixedWords * index + i] = 0u;
    if (index <= push.headMask) push.heads.v[index] = kNone;
    if (index < kCausticPatches) {
        push.cache.v[index].key = 0u;
        push.cache.v[index].irradiance = vec3(0.0);
        for (uint i = 0u; i < kFixedWords; ++i) push.cacheSums.v[kFixedWords * index + i] = 0u;
    }
}
