// What changes from frame to frame, reachable from every pass by one address.
#ifndef TL_SHARED_FRAME_H
#define TL_SHARED_FRAME_H

#include "shared/scene.h"
#include "shared/types.h"

TL_BEGIN

// A thin-lens camera. Pixel (x, y), row 0 at the top, with film position (x, y) / (width, height) in [0,1]^2:
// direction = filmCorner + x * filmU + y * filmV (at distance 1 along the optical axis, unnormalised).
struct Camera {
    vec3 position;
    float lensRadius; // metres; 0: pinhole
    vec3 filmCorner;
    float focusDistance; // metres along the optical axis
    vec3 filmU;
    float nearClip; // along the optical axis
    vec3 filmV;
    float farClip;
    vec3 right;     // unit
    float filmArea; // of the film rectangle at distance 1, for importance
    vec3 up;
    float pixelAngle; // radians across one pixel, for ray differentials
    vec3 forward;
    uint padding;
};

struct FrameConstants {
    SceneTable scene;
    Camera camera;
    Camera previousCamera;
    uint width;
    uint height;
    uint frameIndex;  // grows by one with each frame rendered; indexes sample sequences
    uint sampleIndex; // frames since averaging began
    uint seed;
    uint flags;              // kFrame*
    TL_REF(uint) counters;   // kCounter*
    TL_REF(uint) bsdfTables; // shared/bsdf_tables.h
    // Last frame, for what is reused from it. Of the frames averaged into one picture only the first follows a change:
    // to the others (without kFrameChanged) last frame was like this one, and previousScene is the same as scene.
    TL_REF(SceneTable) previousScene;
    TL_REF(uint) currentLight;  // of a light of previousScene, its index in scene; kNone: gone
    TL_REF(uint) previousLight; // the reverse; both with kFrameLightsRenumbered, else lights keep their places
};

TL_CONST uint kFrameSobol = 1;         // sampler.sequence = sobol
TL_CONST uint kFrameUncompensated = 2; // light.selection = uncompensated
TL_CONST uint kFrameChanged = 4;       // the scene or the camera is not as it was last frame
TL_CONST uint kFrameLightsRenumbered = 8;

// Passes that spread their groups (scene/pass.glsl, spreadGroup) have a multiple of so many, of so many threads.
TL_CONST uint kGroupSpread = 16;
TL_CONST uint kSpreadGroupSize = 64;

TL_CONST uint kCounterRays = 0;
TL_CONST uint kCounterNonfinite = 1; // pixels whose sample was not finite
TL_CONST uint kCounterPhotons = 8;
TL_CONST uint kCounterProbes = 2;
TL_CONST uint kCounterProbesActive = 3;  // those that lookups use
TL_CONST uint kCounterProbesUpdated = 4; // counted once for each update
TL_CONST uint kCounterCount = 16;

TL_DECLARE_ALIGNED_REF(FrameConstants, 8)

TL_END

#endif
