// What the denoise node keeps of surfaces and signals; plugins/denoise/README.md has the equations.
#ifndef TL_SHARED_DENOISE_H
#define TL_SHARED_DENOISE_H

#include "shared/visibility.h"

TL_BEGIN

// What a pixel shows: the surface that was shaded, behind mirrors and glass.
struct DenoiseSurface {
    vec3 position;
    uint normal; // octahedral, on the side of the ray; its lowest bit: behind mirrors or glass
    vec3 albedo; // throughput of the chain times the BSDF's albedo; its mean over `frames`
    float frames;
    uint chain; // specular bounces before it; kNone: nothing was shaded
};
TL_DECLARE_REF(DenoiseSurface)

// Where the surface was in the last frame.
struct DenoiseReprojection {
    uint corner;  // the upper left of four pixels: x + 1 | (y + 1) << 16
    uint weights; // of the four, packUnorm4x8; 0: nowhere
    vec3 gain;    // of albedo since then
};
TL_DECLARE_REF(DenoiseReprojection)

// Radiance of one signal over `frames` frames.
struct DenoiseHistory {
    vec3 mean;
    float squares; // mean of squared luminance
    float frames;
};
TL_DECLARE_REF(DenoiseHistory)

// Emission of a pixel, whatever its path: mirrors and glass choose at random.
struct DenoiseEmission {
    vec3 mean;
    float squares; // mean of squared luminance
    float frames;
    uint light; // that it came from last: VisibleEmitter::light, without kEmitterSpecular
};
TL_DECLARE_REF(DenoiseEmission)

struct DenoiseEmissionPush {
    TL_REF(FrameConstants) frame;
    TL_REF(vec3) emission;
    TL_REF(VisibleEmitter) emitters;
    TL_REF(DenoiseEmission) previous; // read with kDenoiseHistory
    TL_REF(DenoiseEmission) histories;
    uint flags; // kDenoise*
    float maxFrames;
};

struct DenoiseSurfacesPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(DenoiseSurface) previous; // read with kDenoiseHistory
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseReprojection) reprojection; // written unless kDenoiseStill
    uint flags;                               // kDenoise*
    float maxFrames;
};
TL_CONST uint kDenoiseStill = 1;       // nothing moved since the last frame
TL_CONST uint kDenoiseCameraStill = 2; // the camera did not
TL_CONST uint kDenoiseUnfiltered = 4;  // signals become the mean of their history
TL_CONST uint kDenoiseHistory = 8;     // there is a last frame; of signal i: this bit times 2^i

// Signals are denoised several at a time: what surfaces have in common is the same for all.
TL_CONST uint kDenoiseBatch = 3;

struct DenoiseAccumulatePush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseReprojection) reprojection; // read unless kDenoiseStill
    TL_REF(vec3) signals[kDenoiseBatch];
    TL_REF(DenoiseHistory) previous[kDenoiseBatch]; // read with kDenoiseHistory
    TL_REF(DenoiseHistory) histories[kDenoiseBatch];
    TL_REF(vec4) differences[kDenoiseBatch]; // moments of what this frame differs by, written by expect.comp
    uint flags;                              // kDenoise*
    float maxFrames;
};

// Passes along an axis: a thread takes kDenoiseChain pixels, `spacing` apart.
TL_CONST uint kDenoiseChain = 4;

struct DenoiseSumPush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseHistory) histories[kDenoiseBatch];
    TL_REF(vec4) from[kDenoiseBatch]; // moments: pixels (1 or 0); luminance without albedo, its square, its variance
    TL_REF(vec4) to[kDenoiseBatch];   // their sums, or estimates: radiance over albedo, and variance of its luminance
    uint axis;                        // 0: x, 1: y
    int spacing;
    float changeSigma;
};

struct DenoiseFilterPush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseHistory) histories[kDenoiseBatch];
    TL_REF(vec4) from[kDenoiseBatch]; // estimates
    TL_REF(vec4) to[kDenoiseBatch];
    TL_REF(vec3) signals[kDenoiseBatch]; // written by the last pass
    uint axis;
    int spacing;
    float sigma;
};

TL_END

#endif
