// Push constants of the passes that shade and of those that gather their signals.
#ifndef TL_SHARED_PASSES_H
#define TL_SHARED_PASSES_H

#include "shared/visibility.h"

TL_BEGIN

struct RaytracePush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(vec3) direct;
};

struct PathtracePush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(vec3) direct;   // L D S* E
    TL_REF(vec3) caustic;  // L S+ D S* E
    TL_REF(vec3) indirect; // two or more D
    uint maxDepth;         // surfaces after the visible point
    uint rouletteDepth;    // of them, how many before Russian roulette
};

// Sums over frames with Kahan's compensation, so that a million frames average as well as ten.
struct PixelSums {
    vec3 sum;
    vec3 compensation;
    float squares; // of luminance
};
TL_DECLARE_REF(PixelSums)

TL_CONST uint kCompositeSignals = 8;

struct CompositePush {
    TL_REF(FrameConstants) frame;
    TL_REF(PixelSums) previous;
    TL_REF(PixelSums) sums;
    TL_REF(vec3) color;      // this frame's radiance
    TL_REF(vec3) signals[8]; // kCompositeSignals
    uint signalCount;
    uint restart; // 1: sums start anew
};

struct AccumulatePush {
    TL_REF(FrameConstants) frame;
    TL_REF(float) previous;
    TL_REF(float) sum;
    TL_REF(float) values[8]; // kCompositeSignals
    uint valueCount;
    uint channels;
    uint restart;
};

struct PostPush {
    TL_REF(FrameConstants) frame;
    TL_REF(PixelSums) sums;
    TL_REF(uint) display; // RGBA8, sRGB-encoded, red in the lowest byte
    float exposure;       // factor
    uint tonemap;         // kTonemap* (shared/display.h)
    uint frames;          // in the sums
};
TL_END

#endif
