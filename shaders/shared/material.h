// One layered surface model; the meaning of each field is that of trilume::Material (engine/scene/components.h).
#ifndef TL_SHARED_MATERIAL_H
#define TL_SHARED_MATERIAL_H

#include "shared/types.h"

TL_BEGIN

TL_CONST uint kMaterialSpecularWorkflow = 1;
TL_CONST uint kMaterialTextured = 2; // any map at all
TL_CONST uint kMaterialCutout = 4;   // opacity below 1 or mapped
TL_CONST uint kMaterialEmissive = 8;

// Index into textureInputs; 0 is "no map".
struct Material {
    vec3 baseColor;
    float metallic;
    vec3 specularColor;
    float roughness;
    vec3 transmissionColor;
    float transmission;
    vec3 emission;
    float ior;
    float specular;
    float clearcoat;
    float clearcoatRoughness;
    float clearcoatIor;
    float opacity;
    float opacityThreshold;
    uint flags;
    uint baseColorMap;
    uint metallicMap;
    uint roughnessMap;
    uint emissionMap;
    uint opacityMap;
    uint normalMap;
    uint specularColorMap;
    uint clearcoatMap;
    uint clearcoatRoughnessMap;
    uint transmissionMap;
};

// value = texel(channel) * scale + bias at st = uTransform.xy * st + offset.
struct TextureInput {
    vec4 scale;
    vec4 bias;
    vec2 du; // columns of the 2x2 part
    vec2 dv;
    vec2 offset;
    uint image;  // bindless index
    int channel; // -1: rgb
    vec2 black;  // 1 for each coordinate that is black beyond [0,1], else 0
};

TL_DECLARE_REF(Material)
TL_DECLARE_REF(TextureInput)

TL_END

#endif
