// What the visibility node leaves for the nodes that shade.
#ifndef TL_SHARED_VISIBILITY_H
#define TL_SHARED_VISIBILITY_H

#include "shared/frame.h"

TL_BEGIN

// The first non-specular surface of the pixel's path. A hit stands for itself, without its ray (scene/surface.glsl).
struct VisiblePoint {
    uint instance; // kNone: the path left the scene
    uint primitive;
    vec2 uv;
    vec3 direction;  // of the ray that arrived, unit
    float footprint; // world-space width of the pixel at the point, along the path
    vec3 throughput; // of the specular chain before it; divided by the probability of having stopped here
    uint dimension;  // where the pixel's sample sequence goes on
    uint chain;      // specular bounces before the point, or before the path left; 0: seen directly
};

TL_DECLARE_REF(VisiblePoint)

// Where the pixel's emission comes from: the brightest emitter on its path, else the path's end.
struct VisibleEmitter {
    uint light;  // its index; kEmitter*
    vec2 motion; // pixels since last frame of the place where it is seen
};
TL_CONST uint kEmitterNone = 0x7fffffffu;     // in place of the index: nothing emits
TL_CONST uint kEmitterInfinite = 0x7ffffffeu; // the lights at infinity together
TL_CONST uint kEmitterSpecular =
    0x80000000u; // added to it: mirrors or glass on the path, which may choose another next time

TL_DECLARE_REF(VisibleEmitter)

struct VisibilityPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(vec3) emission;           // L S* E
    TL_REF(VisibleEmitter) emitters; // written with kVisibilityEmitters
    TL_REF(vec3) albedo;             // the four planes of the first surface are written with kVisibilityGuides
    TL_REF(vec3) normal;
    TL_REF(float) depth; // metres along the optical axis; 0: nothing hit
    TL_REF(vec2) motion; // pixels from where the point was in the last picture to where it is
    uint maxBounces;
    uint flags;
};
TL_CONST uint kVisibilityGuides = 1;
TL_CONST uint kVisibilityEmitters = 2;

TL_END

#endif
