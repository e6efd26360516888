// Choice of lights by what a tile of pixels has learned of them (passes/restir_di/learn.comp). TL_CHOICE 0: there is one
// light, and nothing to choose.
#ifndef TL_SCENE_LIGHT_TILES_GLSL
#define TL_SCENE_LIGHT_TILES_GLSL

#include "scene/lights.glsl"
#include "scene/previous.glsl"
#include "shared/restir_di.h"

// How the light samples of one visible point are shared out.
struct LightChoice {
#if TL_CHOICE
    uint lights[kTileLights];
    float shares[kTileLights]; // of the learned samples; they sum to 1 where there are any
    float bound;               // of what any other light brings, by luminance; 0: nothing is known
#endif
    uint learned; // samples
    uint byPower;
};

uint tileIndex(uvec2 tile) { return tile.y * ((TL_FRAME.width + kTileSide - 1u) / kTileSide) + tile.x; }

LightChoice lightChoice(uint samples) {
    LightChoice c;
    c.learned = 0u;
    c.byPower = samples;
#if TL_CHOICE
    c.bound = 0.0;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        c.lights[i] = kNone;
        c.shares[i] = 0.0;
    }
#endif
    return c;
}

#if TL_CHOICE
// Where the tile's lights bring it all its light, `known` samples go to them and one goes by power; where there are so many
// lights that these bring little, the samples go by power as if nothing had been learned. Shares are by the roots of means:
// a light that reaches a part of the tile only is to have enough samples there.
void learnFrom(LightTile tile, uint known, inout LightChoice c) {
    float sum = 0.0, sumOfRoots = 0.0;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        c.lights[i] = tile.means[i] > 0.0 ? currentLight(tile.lights[i]) : kNone;
        const float mean = c.lights[i] == kNone ? 0.0 : tile.means[i];
        c.shares[i] = sqrt(mean);
        sum += mean;
        sumOfRoots += c.shares[i];
    }
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) c.shares[i] = safeDivide(c.shares[i], sumOfRoots);
    const float covered = min(safeDivide(sum, tile.total), 1.0);
    c.bound = tile.total;
    c.learned = uint(covered * float(known) + 0.5);
    c.byPower = 1u + uint((1.0 - covered) * float(c.byPower - 1u) + 0.5);
}
#endif

// The light of sample i.
uint chooseLight(LightChoice c, uint i, inout Sampler rng) {
#if TL_CHOICE
    const uint bits = sampleBits(rng);
    if (i >= c.learned) return lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, bits);
    float u = unitFloat(bits);
    uint light = kNone;
    [[unroll]] for (uint k = 0u; k < kTileLights; ++k) {
        if (c.shares[k] > 0.0 && (light == kNone || u >= 0.0)) light = c.lights[k];
        u -= c.shares[k];
    }
    return light;
#else
    ++rng.dimension; // the numbers that follow are those of ray tracing
    return 0u;
#endif
}

// Expected number of samples of a light: the sum of all samples' probabilities of choosing it.
float choiceDensity(LightChoice c, uint light) {
    float learned = 0.0;
#if TL_CHOICE
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) learned += c.lights[i] == light ? c.shares[i] : 0.0;
#endif
    return float(c.learned) * learned + float(c.byPower) * TL_SCENE.lights.v[light].selection;
}

// The target function of a candidate of this luminance, without shadows and by solid angle; `pdf` is the density by which
// samples of its light make it, so luminance / pdf is what the light would bring. A light of which the tile knows nothing
// brought less than the tile's mean over its pixels: what exceeds that here must be in shadow mostly, and is not to drive out
// the others. The target stays positive, and the weight makes up for it where the light arrives.
float choiceTarget(LightChoice c, uint light, float luminance, float pdf) {
#if TL_CHOICE
    bool known = !(c.bound > 0.0);
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) known = known || c.lights[i] == light;
    const float bound = c.bound * pdf;
    if (!known && bound > 0.0) return min(luminance, bound);
#endif
    return luminance;
}

#endif
