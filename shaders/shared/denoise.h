// What the denoise node keeps of surfaces and signals; plugins/denoise/README.md has the equations.
#ifndef TL_SHARED_DENOISE_H
#define TL_SHARED_DENOISE_H

#include "shared/visibility.h"

TL_BEGIN

// What a pixel shows: the surface that was shaded, behind mirrors and glass.
struct DenoiseSurface {
    vec3 position;
    uint normal; // octahedral, on the side of the ray
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

struct DenoiseSurfacesPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(DenoiseSurface) previous; // read with kDenoiseHistory
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseReprojection) reprojection;
    uint flags; // kDenoise*
    float maxFrames;
};
TL_CONST uint kDenoiseHistory = 1;     // there is a last frame
TL_CONST uint kDenoiseStill = 2;       // nothing moved since
TL_CONST uint kDenoiseCameraStill = 4; // the camera did not

struct DenoiseExpectPush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseReprojection) reprojection;
    TL_REF(vec3) signal;
    TL_REF(DenoiseHistory) previous;
    TL_REF(DenoiseHistory) history;
    TL_REF(vec4) difference; // pixels (1 or 0); from history: difference, its square, its variance by history
    uint flags;
};

struct DenoiseTestPush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseHistory) history;
    TL_REF(vec4) from; // sums of differences
    TL_REF(vec4) to;
    int spacing;
    float changeSigma;
};

struct DenoiseAccumulatePush {
    TL_REF(FrameConstants) frame;
    TL_REF(vec3) signal;
    TL_REF(DenoiseHistory) history;
    float maxFrames;
};

// Signals are filtered several at a time: what surfaces have in common is the same for all.
TL_CONST uint kDenoiseBatch = 3;

struct DenoiseEstimatePush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseHistory) histories[kDenoiseBatch];
    TL_REF(vec4) estimates[kDenoiseBatch]; // irradiance-like: radiance over albedo; and the variance of its luminance
};

struct DenoiseFilterPush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(vec4) from[kDenoiseBatch];
    TL_REF(vec4) to[kDenoiseBatch];
    int spacing;
    float sigma;
};

struct DenoiseResolvePush {
    TL_REF(FrameConstants) frame;
    TL_REF(DenoiseSurface) surfaces;
    TL_REF(DenoiseHistory) history;
    TL_REF(vec4) estimate;
    TL_REF(vec3) signal;
};

TL_END

#endif
