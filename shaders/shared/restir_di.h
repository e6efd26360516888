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
    uint lightCandidates;
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
