// Bidirectional path tracing: what the light pass leaves for the eye pass.
#ifndef TL_SHARED_BPT_H
#define TL_SHARED_BPT_H

#include "shared/restir_di.h"
#include "shared/visibility.h"

TL_BEGIN

// A vertex of a light subpath that eye subpaths may connect to. The first four members are its hit.
struct BptVertex {
    uint instance;
    uint primitive;
    vec2 uv;
    vec3 direction; // unit, to the vertex before
    vec3 flux;      // W, over |cos| of `direction` to the geometric normal
    float dVCM;     // of the weights: shaders/passes/bpt/common.glsl
    float dVC;
};
TL_DECLARE_REF(BptVertex)

// Radiance that light subpaths bring to a pixel: a colour in fixed point (lib/fixed_point.glsl) for each path class.
TL_CONST uint kBptSplatWords = 18;
TL_CONST uint kBptDirect = 0;
TL_CONST uint kBptCaustic = 1;
TL_CONST uint kBptIndirect = 2;

struct BptPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(Reservoir) reservoirs; // restir_di's; null: it has none
    TL_REF(vec3) direct;          // null: it is restir_di's
    TL_REF(vec3) caustic;
    TL_REF(vec3) indirect;
    TL_REF(BptVertex) vertices; // maxVertices for each pixel
    TL_REF(uint) vertexCounts;  // on each pixel's light subpath, also those that were not stored
    TL_REF(uint) splats;        // kBptSplatWords for each pixel
    uint maxVertices;
    uint maxDepth;      // surfaces of each subpath
    uint rouletteDepth; // of them, how many before Russian roulette
    float powerShare;   // of light subpaths, by power and not by reservoir
};

TL_END

#endif
