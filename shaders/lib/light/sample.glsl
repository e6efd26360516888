// What sampling a light gives, and the hook by which lights read their textures.
#ifndef TL_LIB_LIGHT_SAMPLE_GLSL
#define TL_LIB_LIGHT_SAMPLE_GLSL

#include "lib/math.glsl"
#include "shared/scene.h"

// rgb of emission texture `image` at st, (0,0) its lower left corner, finest level: importance sampling knows no other.
#ifndef TL_SAMPLE_TEXTURE
#define TL_SAMPLE_TEXTURE(image, st) vec3(1.0)
#endif

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
