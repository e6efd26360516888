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
    float learned;             // share of the samples that goes to these lights, the rest by power
    float bound;               // of what any other light brings, by luminance; 0: nothing is known
    float offset;              // in [0, 1): of systematic sampling
#endif
    uint samples;
};

uint tileIndex(uvec2 tile) { return tile.y * ((TL_FRAME.width + kTileSide - 1u) / kTileSide) + tile.x; }

LightChoice lightChoice(uint samples) {
    LightChoice c;
    c.samples = samples;
#if TL_CHOICE
    c.learned = c.bound = c.offset = 0.0;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        c.lights[i] = kNone;
        c.shares[i] = 0.0;
    }
#endif
    return c;
}

#if TL_CHOICE
// Where the tile's lights bring it all its light, `enough` samples do, one of them by power: that is how other lights are
// found. Where there are so many lights that these bring little, the samples go by power as if nothing had been learned. In
// the dark no more than `enough` look for light. Shares are by the roots of means: a light that reaches a part of the tile
// only is to have enough samples there.
void learnFrom(LightTile tile, uint enough, inout LightChoice c) {
    float sum = 0.0, sumOfRoots = 0.0;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        c.lights[i] = tile.means[i] > 0.0 ? currentLight(tile.lights[i]) : kNone;
        const float mean = c.lights[i] == kNone ? 0.0 : tile.means[i];
        c.shares[i] = sqrt(mean);
        sum += mean;
        sumOfRoots += c.shares[i];
    }
    const float scale = safeDivide(1.0, sumOfRoots);
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) c.shares[i] *= scale;
    const float covered = min(safeDivide(sum, tile.total), 1.0);
    const float known = covered * float(enough);
    const float count = known + (1.0 - covered) * float(c.samples);
    c.samples = tile.total > 0.0 ? max(uint(count + 0.5), 2u) : min(c.samples, enough);
    c.learned = min(known / count, 1.0 - 1.0 / float(c.samples));
    c.bound = tile.total;
}
#endif

// The light of sample i. Samples are systematic: one random offset, equal steps.
uint chooseLight(LightChoice c, uint i, inout Sampler rng) {
#if TL_CHOICE
    const uint bits = sampleBits(rng);
    const float u = (float(i) + c.offset) / float(c.samples);
    if (u >= c.learned) return lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, bits);
    float left = u / c.learned;
    uint light = kNone;
    [[unroll]] for (uint k = 0u; k < kTileLights; ++k) {
        if (c.shares[k] > 0.0 && (light == kNone || left >= 0.0)) light = c.lights[k];
        left -= c.shares[k];
    }
    return light;
#else
    ++rng.dimension; // the numbers that follow are those of ray tracing
    return 0u;
#endif
}

// Expected number of samples of a light. With a systematic choice that is the sum of the densities of all samples.
float choiceDensity(LightChoice c, uint light) {
    const float selection = TL_SCENE.lights.v[light].selection;
#if TL_CHOICE
    float share = 0.0;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) share += c.lights[i] == light ? c.shares[i] : 0.0;
    return float(c.samples) * mix(selection, share, c.learned);
#else
    return float(c.samples) * selection;
#endif
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
