// What sampling a light gives, which kinds of lights there are, and the hook by which they read their textures.
#ifndef TL_LIB_LIGHT_SAMPLE_GLSL
#define TL_LIB_LIGHT_SAMPLE_GLSL

#include "lib/math.glsl"
#include "shared/scene.h"

// rgb of emission texture `image` at st, (0,0) its lower left corner, finest level: importance sampling knows no other.
#ifndef TL_SAMPLE_TEXTURE
#define TL_SAMPLE_TEXTURE(image, st) vec3(1.0)
#endif

// Bits of the kinds that the scene has, and whether rects or domes have textures: where lanes are those of a CPU's vectors,
// every branch costs, taken or not.
#ifndef TL_LIGHT_KINDS
#define TL_LIGHT_KINDS 0x7f
#endif
#ifndef TL_LIGHT_TEXTURES
#define TL_LIGHT_TEXTURES 1
#endif
bool lightIs(Light light, uint kind) { return (TL_LIGHT_KINDS >> kind & 1) != 0 && light.kind == kind; }
// Whether it is sampled by its texture.
bool lightIsDistributed(Light light) { return TL_LIGHT_TEXTURES != 0 && light.distribution != kNone; }

const float kLightAtInfinity = 1e30;

struct LightSample {
    vec3 wi;             // unit, from the receiver to the light
    float distance;      // kLightAtInfinity: dome, distant
    vec3 radiance;       // W/(m^2 sr) arriving along wi; delta: irradiance on a facing surface, W/m^2
    float pdfSolidAngle; // of wi; delta: 1; 0: no light reaches the receiver
    bool delta;          // wi is the only direction
    vec3 normal;         // unit, on the emitting side at the sampled point; dome, distant: -wi
    vec2 uv;             // rect, dome: texture coordinates; triangle: barycentrics of corners 1 and 2; disk, sphere and
                         // cylinder: as a completed hit has it (scene/surface.glsl); distant: 0
};

const LightSample kNoLight = LightSample(vec3(0, 0, 1), 0.0, vec3(0), 0.0, false, vec3(0, 0, -1), vec2(0));

#endif
