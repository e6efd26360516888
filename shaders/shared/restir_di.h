// What ReSTIR DI keeps of a pixel, and its push constants.
#ifndef TL_SHARED_RESTIR_DI_H
#define TL_SHARED_RESTIR_DI_H

#include "shared/visibility.h"

TL_BEGIN

// A place on a light, drawn for one visible point. With F the contribution f L |d(solid angle) / duv| of that place to
// the point (scene/reservoir.glsl), the estimate of direct light is F W, W counting visibility where `target` does.
struct Reservoir {
    uint light;       // index into its frame's lights; kNone: empty
    vec2 uv;          // light-local (lib/light/local.glsl)
    float weight;     // W, unbiased contribution weight per uv
    float target;     // pHat at its own visible point
    float confidence; // c, in frames of candidates
    uint normal;      // octahedral, of the visible point: looked at before the point is loaded
    float depth;      // length of the path from the camera to the visible point; 0: there is none
};

TL_DECLARE_REF(Reservoir)

// The pixel of last frame that a pixel draws on, and what pHat its sample has here and now.
struct TemporalNeighbor {
    uint pixel; // kNone: none
    float target;
};

TL_DECLARE_REF(TemporalNeighbor)

// What a tile of pixels has learned of the lights: those that bring its visible points the most light. Candidates are
// drawn by it; whatever it holds, they are weighed by the density that they were drawn with.
TL_CONST uint kTileSide = 8; // pixels
TL_CONST uint kTileLights = 8;
struct LightTile {
    uint lights[kTileLights];
    float means[kTileLights]; // luminance of a pixel's direct light from that light, over the last frames; 0: no entry
    float total;              // the same from all lights
    uint frames;              // of which, up to kTileMemory
};
TL_CONST uint kTileMemory = 8;

TL_DECLARE_REF(LightTile)

// The candidate that a pixel has kept.
struct ChosenLight {
    uint light;      // where there is luminance
    float luminance; // of the direct light that it stands for, visibility included; negative: nothing is shaded here
};

TL_DECLARE_REF(ChosenLight)

struct LearnPush {
    TL_REF(FrameConstants) frame;
    TL_REF(ChosenLight) chosen;
    TL_REF(LightTile) tiles;
    uint restart; // 1: nothing was learned before
};

// Which part of the node a pass is.
struct RestirPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(VisiblePoint) previousPoints;
    TL_REF(Reservoir) previous; // last frame's final reservoirs
    TL_REF(TemporalNeighbor) neighbors;
    TL_REF(Reservoir) merged; // this frame's candidates, then with last frame's merged in
    TL_REF(Reservoir) final;
    TL_REF(vec3) direct;
    TL_REF(LightTile) tiles; // of last frame's screen and lights
    TL_REF(ChosenLight) chosen;
    uint learned;           // 1: the tiles hold something
    uint lightCandidates;   // where they don't know the lights
    uint learnedCandidates; // where they do; one of them by power
    uint bsdfCandidates;
    float bsdfRoughness; // rougher surfaces take no BSDF candidates
    float maxHistory;
    uint spatialNeighbors;
    float radius; // pixels
    uint history; // 1: there is a last frame
    uint alone;   // 1: this frame shades with its own candidates; they are kept for the next one
};

TL_END

#endif
