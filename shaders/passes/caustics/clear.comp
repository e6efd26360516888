// Empties what the frame's photons add to: the grid, and the cache where it tells of another scene. What sums hold is taken
// out as it is read.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/push.glsl"

layout(local_size_x = 64) in;

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index <= push.headMask) push.heads.v[index] = kNone;
    if (index < kCausticPatches && (push.flags & kCausticsUnchanged) == 0u) {
        push.cache.v[index].key = 0u;
        push.cache.v[index].irradiance = vec3(0.0);
        push.cache.v[index].density = 0.0;
    }
    if ((push.flags & kCausticsHistory) != 0u) return;
    if (index < kCausticPatches) push.cacheCounts.v[index] = 0u;
    for (uint i = 0u; i < kFixedWords; ++i) {
        if (index < kCausticPatches) push.cacheSums.v[kFixedWords * index + i] = 0u;
        if (index < TL_FRAME.width * TL_FRAME.height) push.splats.v[kFixedWords * index + i] = 0u;
    }
}
