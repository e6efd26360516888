// What the passes of the caustics node share.
#ifndef TL_CAUSTICS_PUSH_GLSL
#define TL_CAUSTICS_PUSH_GLSL

#include "shared/caustics.h"

layout(push_constant, scalar) uniform Push { CausticsPush push; };

#include "lib/fixed_point.glsl"
#include "scene/pass.glsl"

// Units of fixed-point sums, from the light there is and the size of what it shines on, so that pictures of brighter,
// dimmer, larger and smaller scenes are alike: W/(m^2 sr) of pixels, W/m^2 of patches.
float radianceUnit() { return TL_SCENE.lightPower / (TL_SCENE.boundsRadius * TL_SCENE.boundsRadius); }

// Colour `index` of an array of sums in that unit.
void addTo(uintRef sums, uint index, vec3 value) {
    if (!fixedAtomicAdd(sums, kFixedWords * index, value / radianceUnit()))
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
}

// The colour, which is 0 from then on.
vec3 takeSum(uintRef sums, uint index) {
    const vec3 color = fixedColor(sums, kFixedWords * index);
    if (color == vec3(0.0)) return color;
    for (uint i = 0u; i < kFixedWords; ++i) sums.v[kFixedWords * index + i] = 0u;
    return color * radianceUnit();
}

void countArrivals(uint arrivals) {
    const uint sum = subgroupAdd(arrivals);
    if (subgroupElect()) atomicAdd(push.state.v[0].arrivals, sum);
}

#endif
