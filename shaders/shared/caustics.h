// What the passes of the caustics node pass on to each other and to other nodes.
#ifndef TL_SHARED_CAUSTICS_H
#define TL_SHARED_CAUSTICS_H

#include "shared/visibility.h"

TL_BEGIN

// Light is aimed at (group of lights, caster, cell of the caster's disk), each with a learned weight.
TL_CONST uint kGuideGroups = 32; // neighbours in the light table share one where there are more lights
TL_CONST uint kGuideSide = 8;
TL_CONST uint kGuideCells = kGuideSide * kGuideSide;
TL_CONST uint kGuideTargets = kMaxCasters * kGuideCells; // of each group of lights

struct GuideTarget {
    float learned;    // useful flux through the target, mean over past frames, in units of all light's power
    uint flux;        // the same of this frame, in units of 1/kGuideUnit times the photons emitted
    float cumulative; // probability of it and all before it in its group
};
TL_CONST uint kGuideUnit = 64;

struct CausticState {
    uint emitted;  // photons of this frame
    uint whole;    // as many as it would emit if its share were 1
    uint arrivals; // pairs of a photon and a pixel that it lights
    uint lit;      // pixels with an arrival
};

// A photon that came through mirrors and glass to the surface where it ends.
struct Photon {
    vec3 position;
    uint normal;    // octahedral, the surface's front side
    vec3 flux;      // W; 0: it did not land
    uint direction; // octahedral, towards where it came from
    uint next;      // photon in the same cell of the grid, or kNone
};

// The cache: irradiance by patch of surface, a hash table with linear probing. See scene/caustic_cache.glsl.
struct CausticPatch {
    uint key; // 0: empty
    vec3 irradiance;
    float density; // of photons that land here, of each that is emitted, 1/m^2
};
TL_CONST uint kCausticPatches = 1u << 16;
TL_CONST uint kCausticPatchProbes = 32;

TL_DECLARE_REF(GuideTarget)
TL_DECLARE_REF(CausticState)
TL_DECLARE_REF(Photon)
TL_DECLARE_REF(CausticPatch)

struct CausticsPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(VisiblePoint) previousPoints;
    TL_REF(vec3) caustic;
    TL_REF(vec4) mean;         // over frames, and how many
    TL_REF(vec4) previousMean; // with kCausticsUnchanged
    TL_REF(uint) splats;       // kFixedWords for each pixel
    TL_REF(GuideTarget) guide;
    TL_REF(GuideTarget) previousGuide; // with kCausticsHistory, as the state
    TL_REF(CausticState) state;
    TL_REF(CausticState) previousState;
    TL_REF(Photon) photons;
    TL_REF(uint) heads; // of the grid's cells: the first photon, or kNone
    TL_REF(CausticPatch) cache;
    TL_REF(uint) cacheSums;   // of this frame, kFixedWords for each patch
    TL_REF(uint) cacheCounts; // of this frame's photons, for each patch
    float uniformShare;       // of photons, emitted as the light emits
    float gatherRadius;       // pixels
    float share;              // of the photons wanted, and of a frame in means
    float historyFrames;      // in a pixel's mean at most
    float cacheShare;         // of this frame in the cache's mean
    uint photonLimit;         // of this frame
    uint headMask;            // number of cells - 1, a power of 2 less 1
    uint knownGroups;         // of lights, of which previousGuide tells
    uint knownCasters;        // likewise
    uint flags;               // kCaustics*
};
TL_CONST uint kCausticsHistory = 1;   // else buffers hold anything
TL_CONST uint kCausticsUnchanged = 2; // lights, things and materials, since last frame
TL_CONST uint kCausticsCameraMoved = 4;
TL_CONST uint kCausticsKernel = 8; // for what is seen directly too, in place of splats

TL_END

#endif
