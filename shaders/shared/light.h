// Sampled lights: every emitting thing that next-event estimation can choose, emissive triangles one by one.
#ifndef TL_SHARED_LIGHT_H
#define TL_SHARED_LIGHT_H

#include "shared/types.h"

TL_BEGIN

TL_CONST uint kLightRect = 0;
TL_CONST uint kLightDisk = 1;
TL_CONST uint kLightSphere = 2;
TL_CONST uint kLightCylinder = 3;
TL_CONST uint kLightDistant = 4;
TL_CONST uint kLightDome = 5;
TL_CONST uint kLightTriangle = 6;

// Half axes are world images of the round shape's local ones, so that scaled and sheared lights stay exact.
struct Light {
    uint kind;
    uint instance;     // whose surface it is; kNone: distant, dome
    uint image;        // rect, dome: bindless index of the emission texture; triangle, sphere: where textures or
                       // cut-outs make its emission vary (radiance is a mean), its index in the mesh, or 0; else kNone
    uint distribution; // index into distributions for importance-sampled textures, or kNone
    vec3 radiance;   // W/(m^2 sr), multiplied by the texture where there is one; distant of angle 0: irradiance, W/m^2
    float selection; // probability that the alias table chooses this light
    vec3 position;   // rect, disk, sphere, cylinder: centre; triangle: corner 0
    float area;      // world space; distant, dome: 0
    vec3 axisU;      // rect: full edge along local x; disk, sphere: half axis; cylinder: full axis; triangle: edge 0-1;
                     // dome, distant: world direction of local x
    float radius;    // sphere, cylinder: length of the half axis along local z; distant: 1 - cos(half angle), which a
                     // cosine could not hold for narrow lights; 0: one direction only
    vec3 axisV;      // rect: full edge along local y; disk, sphere, cylinder: half axis; triangle: edge 0-2;
                     // dome, distant: local y
    float cosHalfAngle; // distant
    vec3 normal;        // unit; emitting side (rect, disk: world direction of local -z; triangle: front side);
                        // sphere, cylinder: direction of the half axis along local z; distant: direction that the light
                        // travels; dome: local z
    uint id;            // stable from frame to frame
};

// Vose's alias method: entry i is taken with probability `threshold`, else `alias`.
struct AliasEntry {
    float threshold;
    uint alias;
};

TL_DECLARE_REF(Light)
TL_DECLARE_REF(AliasEntry)

// Piecewise-constant density on [0,1]^2 of texture coordinates over a width x height grid, row 0 at v = 0 (the
// picture's bottom). Inversion of the marginal and then the conditional cumulative sums keeps stratification.
struct Distribution {
    TL_REF(float) marginal;    // height + 1 entries, from 0 to 1
    TL_REF(float) conditional; // height rows of width + 1 entries, each from 0 to 1
    TL_REF(float) density;     // height x width, pdf with respect to du dv
    uint width;
    uint height;
};

TL_DECLARE_ALIGNED_REF(Distribution, 8)

TL_END

#endif
