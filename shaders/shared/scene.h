// The scene as every pass sees it. World space here is "render space": metres relative to SceneTable's origin, which
// the host chose near the scene's centre so that single precision is spent on the scene and not on its distance from 0.
#ifndef TL_SHARED_SCENE_H
#define TL_SHARED_SCENE_H

#include "shared/bvh.h"
#include "shared/light.h"
#include "shared/material.h"
#include "shared/types.h"

TL_BEGIN

TL_CONST uint kNone = 0xffffffffu;

// What an instance places. Shapes other than meshes are exact, of unit size in local space:
// sphere: radius 1 at the origin; rect: [-1/2, 1/2]^2 in z = 0; disk: radius 1 in z = 0; cylinder: radius 1 about x,
// x in [-1/2, 1/2], open ends. Front sides: rect and disk -z, sphere and cylinder outward.
TL_CONST uint kShapeMesh = 0;
TL_CONST uint kShapeSphere = 1;
TL_CONST uint kShapeRect = 2;
TL_CONST uint kShapeDisk = 3;
TL_CONST uint kShapeCylinder = 4;

// Which rays an instance answers.
TL_CONST uint kMaskCamera = 1;
TL_CONST uint kMaskShadow = 2;
TL_CONST uint kMaskIndirect = 4;
TL_CONST uint kMaskAll = 7;

TL_CONST uint kInstanceFlips = 1; // worldFromLocal mirrors: counter-clockwise becomes clockwise

struct Mesh {
    TL_REF(BvhNode) nodes;
    TL_REF(LeafTriangle) leafTriangles; // as the compute tracer reads them
    TL_REF(uvec3) triangles;            // corner indices into positions
    TL_REF(vec3) positions;
    TL_REF(vec3) normals; // per corner; null: flat
    TL_REF(vec2) uvs;     // per corner; null: none
    TL_REF(uint) subsets; // per triangle; null: all 0
    uint triangleCount;
    uint flags; // kMeshHasNormals, kMeshHasUvs, kMeshHasSubsets
};
TL_CONST uint kMeshHasNormals = 1;
TL_CONST uint kMeshHasUvs = 2;
TL_CONST uint kMeshHasSubsets = 4;

struct Instance {
    mat4x3 localFromWorld;
    mat4x3 worldFromLocal;
    mat4x3 previousWorldFromLocal;
    uint shape;         // kShape*
    uint mesh;          // index into meshes; shapes: kNone
    uint firstMaterial; // into materialIndices, plus the triangle's subset
    uint firstLight; // light of triangle i of an emissive mesh: lightOfTriangle[firstLight + i]; of a shape: the light
                     // itself; kNone: emits nothing
    uint mask;
    uint flags;
};

// A ball around surfaces with delta lobes: where photons are aimed at for caustics.
struct Caster {
    vec3 center;
    float radius;
};
TL_CONST uint kMaxCasters = 32; // where there are more, neighbours share a ball

TL_DECLARE_ALIGNED_REF(Mesh, 8)
TL_DECLARE_REF(Instance)
TL_DECLARE_REF(Caster)

struct SceneTable {
    TL_REF(BvhNode) topNodes;  // over instances
    TL_REF(uint) topInstances; // leaf order to instance
    TL_REF(Instance) instances;
    TL_REF(Mesh) meshes;
    TL_REF(Material) materials;
    TL_REF(TextureInput) textureInputs;
    TL_REF(uint) materialIndices;
    TL_REF(Light) lights;
    TL_REF(AliasEntry) lightAlias; // over lights, by power
    TL_REF(uint) lightOfTriangle;  // kNone where a triangle of an emissive instance emits nothing
    TL_REF(Distribution) distributions;
    TL_REF(Caster) casters;
    uint instanceCount;
    uint lightCount;
    uint infiniteLightCount; // lights at infinity (dome, distant) stand first in `lights`
    uint casterCount;
    vec3 boundsCenter;
    float boundsRadius; // of everything finite; 0: empty
    float lightPower;   // of all lights, W by luminance; of those at infinity what enters the bounds
    uint padding;       // to a multiple of 8 bytes: C++ and scalar layout then agree on what follows
};

TL_DECLARE_ALIGNED_REF(SceneTable, 8)

TL_END

#endif
