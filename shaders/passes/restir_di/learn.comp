// Learning of lights: which ones bring light to a tile's visible points, by the candidates that its pixels kept. One thread a
// tile. A candidate stands for all direct light of its pixel in expectation, so the mean over pixels and frames by light
// estimates each light's part, shadows included.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/restir_di.h"

layout(push_constant, scalar) uniform Push { LearnPush push; };

#include "scene/light_tiles.glsl"
#include "scene/pass.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// A mean after another frame. Faint ones are forgotten, before they are too small to divide by.
float remembered(float mean, float share) {
    const float kFaintest = 1e-20;
    return mean * share > kFaintest ? mean * share : 0.0;
}

// The light's place in the list; a new one takes that of the weakest.
void credit(uint light, float amount, inout LightTile tile) {
    uint place = 0u;
    bool known = false;
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        if (tile.means[i] > 0.0 && tile.lights[i] == light) {
            place = i;
            known = true;
        }
        if (!known && tile.means[i] < tile.means[place]) place = i;
    }
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        if (i != place) continue;
        tile.means[i] = (known ? tile.means[i] : 0.0) + amount;
        tile.lights[i] = light;
    }
}

void main() {
    const uvec2 first = gl_GlobalInvocationID.xy * kTileSide;
    if (!insideView(first)) return;
    const uint index = tileIndex(gl_GlobalInvocationID.xy);
    LightTile tile;
    if (push.restart != 0u) {
        [[unroll]] for (uint i = 0u; i < kTileLights; ++i) tile.means[i] = 0.0;
        tile.total = 0.0;
        tile.frames = 0u;
    } else {
        tile = push.tiles.v[index];
    }
    tile.frames = min(tile.frames + 1u, kTileMemory);
    const float weight = 1.0 / float(tile.frames);
    tile.total = remembered(tile.total, 1.0 - weight);
    [[unroll]] for (uint i = 0u; i < kTileLights; ++i) {
        const uint light = tile.means[i] > 0.0 ? currentLight(tile.lights[i]) : kNone;
        tile.lights[i] = light;
        tile.means[i] = light == kNone ? 0.0 : remembered(tile.means[i], 1.0 - weight);
    }
    const uvec2 end = min(first + kTileSide, uvec2(TL_FRAME.width, TL_FRAME.height));
    uint shaded = 0u;
    for (uint y = first.y; y < end.y; ++y)
        for (uint x = first.x; x < end.x; ++x)
            if (push.chosen.v[pixelIndex(uvec2(x, y))].luminance >= 0.0) ++shaded;
    const float share = weight / float(max(shaded, 1u));
    for (uint y = first.y; y < end.y; ++y) {
        for (uint x = first.x; x < end.x; ++x) {
            const ChosenLight chosen = push.chosen.v[pixelIndex(uvec2(x, y))];
            if (!(chosen.luminance > 0.0)) continue;
            credit(chosen.light, share * chosen.luminance, tile);
            tile.total += share * chosen.luminance;
        }
    }
    push.tiles.v[index] = tile;
}
