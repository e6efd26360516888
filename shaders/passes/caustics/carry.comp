// Takes what the cache held into this frame's table, weighed against what this frame will add.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/push.glsl"

#include "scene/caustic_cache.glsl"

layout(local_size_x = 64) in;

void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= kCausticPatches || (push.flags & kCausticsUnchanged) == 0u) return;
    const CausticPatch before = push.previousCache.v[index];
    if (before.key == 0u) return;
    const uint slot = insertCausticPatch(push.cache, uvec2(before.home, before.key));
    if (slot != kNone) push.cache.v[slot].irradiance = (1.0 - push.cacheShare) * before.irradiance;
}
