// Irradiance probes: what they hold, and the push constants of the passes that keep and read them.
#ifndef TL_SHARED_DDGI_H
#define TL_SHARED_DDGI_H

#include "shared/caustics.h"

TL_BEGIN

// Nodes of an octahedral map a side, its border included: the six axes are nodes, and a lookup stays in one square.
TL_CONST uint kProbeIrradianceSide = 9;
TL_CONST uint kProbeDistanceSide = 16;
TL_CONST uint kProbeIrradianceNodes = 81;
TL_CONST uint kProbeDistanceNodes = 256;

TL_CONST uint kProbeActive = 1;    // lookups use it
TL_CONST uint kProbeConverged = 2; // sleeps unless watched
TL_CONST uint kProbeLitBack = 4;   // it has seen a lit surface from behind: two-sided ones, not the inside of a thing
TL_CONST uint kProbeNearby = 8;    // it has seen something within its voxel
TL_CONST uint kProbeEmpty = 16;    // nothing is there: it sends no rays

struct Probe {
    vec3 offset;     // from its grid point, metres
    uint flags;      // kProbe*
    float count;     // of updates in the mean irradiance; falls when the light changes
    float seen;      // of updates in the mean distances
    float spared;    // variance of the rounds in the mean irradiance over that of rounds of all rays
    float backShare; // mean share, of the surfaces met, of unlit ones met from behind
    uint updates;    // since the volume began: indexes sample sequences
    uint watch;      // updates for which it stays awake
    uint moves;      // that it may still make
    uint settle;     // updates for which the mean follows a change of the light at once
    // Luminance of the irradiance along the axes (x, y, z; -x, -y, -z), W/m^2: a fast mean, the last update's, and the
    // variance of one update. In tallied rounds `last` holds what its rays see in all, and what of that probes told.
    vec3 fast[2];
    vec3 last[2];
    vec3 variance[2];
};

TL_DECLARE_REF(Probe)

TL_CONST uint kProbeVolumes = 4; // at most

// A grid of probes. Distances of all kinds are told in its spacing, the largest of its steps.
struct ProbeVolume {
    TL_REF(Probe) probes;
    TL_REF(vec3) irradiance; // kProbeIrradianceNodes for each probe, W/m^2
    TL_REF(uint)
    distances;     // kProbeDistanceNodes for each probe: half floats, mean and standard deviation of log2 of spacings
    vec3 origin;   // of probe (0, 0, 0), render space
    float spacing; // metres
    vec3 steps;    // between probes along each axis, metres
    uint probeCount;
    uvec3 counts;
    uvec3 scroll;  // where probe (0, 0, 0) stands in memory, which wraps around along each axis
    uint selected; // probes that this round updates
    uint awake;    // halves of probes that took turns in the last round: one that serves nobody takes every other turn
    uint serving;  // probes that lookups use
    uint rays;     // of each probe in this round
    uint period;   // an awake probe is updated once in so many rounds
    uint round;    // of turns since the volume began: a frame's index may begin anew with each picture
    vec3 seen;     // by all rays of the last round that was tallied, radiance
    vec3 growth;   // of the probes' light until all bounces are in it
};

TL_DECLARE_ALIGNED_REF(ProbeVolume, 8)

struct ProbeRay {
    vec3 direction;
    float distance; // to the first surface, spacings; kProbeRayMissed: none
    vec3 radiance;  // scattered towards the probe, W/(m^2 sr)
    uint flags;     // kProbeRay*; upper bytes, in tallied rounds: what part of radiance probes told, by channel
};
TL_CONST float kProbeRayMissed = 1e30f;
TL_CONST uint kProbeRayBack = 1; // the surface was met from behind
TL_CONST uint kProbeRayLit = 2;  // light reaches the surface directly

TL_DECLARE_REF(ProbeRay)

// A probe that takes part in a round, and the weights with which the round enters its means.
struct ProbeTurn {
    uint probe;
    float irradianceWeight;
    float distanceWeight;
};

TL_DECLARE_REF(ProbeTurn)

struct ProbeBeginPush {
    TL_REF(FrameConstants) frame;
    TL_REF(ProbeVolume) volume;
    TL_REF(Probe) probes;
    TL_REF(vec3) irradiance;
    TL_REF(uint) distances;
    vec3 origin;
    float spacing;
    vec3 steps;
    uvec3 counts;
    uvec3 scroll;
    uint rays;   // of each probe
    uint fewest; // should there be too many probes for the budget
    uint budget; // rays of awake probes for each round; 0: all probes
    uint waking; // 1: all probes are awake now, whatever they were
};

struct ProbeUpdatePush {
    TL_REF(FrameConstants) frame;
    TL_REF(ProbeVolume) volume;  // that the round is of
    TL_REF(ProbeVolume) volumes; // all
    TL_REF(ProbeTurn) turns;     // of this round, in no order
    TL_REF(ProbeRay) rays;
    TL_REF(CausticPatch) causticCache; // with TL_CAUSTIC_CACHE, as the next two
    TL_REF(Photon) photons;
    TL_REF(CausticState) causticState;
    uint rayCount; // of a probe in a round that need not spare them
    uint flags;    // kProbeUpdate*
    float tolerance;
    ivec3 shift;     // of the grid in this frame, in probes; with kProbeUpdateScrolled
    uint firstProbe; // of the volume, among those of all
};
// Which probes a round updates; with none of the first five, those awake take turns.
TL_CONST uint kProbeUpdateRestart = 1;    // all, of which nothing is known yet: they see surfaces, not yet their light
TL_CONST uint kProbeUpdateMoved = 2;      // likewise those that have just moved
TL_CONST uint kProbeUpdateBounce = 4;     // active ones take in one more bounce: the round replaces their irradiance
TL_CONST uint kProbeUpdateActive = 8;     // active ones
TL_CONST uint kProbeUpdateFresh = 16;     // of them, or of those that take in a bounce, whose means have hardly begun
TL_CONST uint kProbeUpdateChanged = 32;   // the scene is another than in the last frame
TL_CONST uint kProbeUpdateRelit = 64;     // its lights are
TL_CONST uint kProbeUpdateRoused = 128;   // and it had been at rest
TL_CONST uint kProbeUpdateScrolled = 256; // the volume has moved: probes that it had not had before begin anew
TL_CONST uint kProbeUpdateTally = 512;    // rays are summed up, for `growth`
TL_CONST uint kProbeUpdatePlaced = 1024;  // of those that have just moved, the last round: they stay where they are

// What probes told a pixel when it was looked up last, and of which triangle.
struct ProbeLookup {
    vec3 radiance; // scattered towards the camera, W/(m^2 sr)
    uint instance; // kNone: nothing is known
    uint primitive;
};

TL_DECLARE_REF(ProbeLookup)

// A thread of the gathering pass has so many pixels; of a picture that stands still, one of them is looked up in each
// frame.
TL_CONST uint kLookupColumns = 2;
TL_CONST uint kLookupRows = 4;
TL_CONST uint kLookupTurns = kLookupColumns * kLookupRows;

struct ProbeGatherPush {
    TL_REF(FrameConstants) frame;
    TL_REF(VisiblePoint) points;
    TL_REF(ProbeVolume) volumes;
    TL_REF(CausticPatch) causticCache; // with TL_CAUSTIC_CACHE
    TL_REF(vec3) indirect;
    TL_REF(ProbeLookup) before;  // gather.comp's: what pixels were told so far
    TL_REF(ProbeLookup) lookups; // gather.comp's: and are told now; the same memory unless `moved`
    uint turn;  // gather.comp's, of kLookupTurns: pixels that do not keep what they were told; kNone: all
    uint moved; // gather.comp's: the camera, where pixels keep anything
};

TL_END

#endif
