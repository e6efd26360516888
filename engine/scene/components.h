#pragma once

#include "ecs/world.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace trilume {

/// Assets live in slots of the scene; a revision grows with each change so that uploads follow changes only.
enum class MeshId : uint32_t { None = ~0u };
enum class MaterialId : uint32_t { None = ~0u };
enum class TextureId : uint32_t { None = ~0u };

struct MeshBvh; // scene/mesh_bvh.h

/// Triangles, in the local space of whoever instances them. Scene units are metres after loading.
struct Mesh {
    std::string name; ///< prim path, for messages
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;    ///< indices into positions; counter-clockwise seen from the front
    std::vector<glm::vec3> normals;       ///< per corner (3 per triangle) or empty: flat
    std::vector<glm::vec2> uvs;           ///< per corner or empty
    std::vector<uint32_t> triangleSubset; ///< per triangle: index into MeshInstance::materials; empty: all 0
    bool deforming = false;               ///< positions have time samples: refit rather than rebuild
    uint64_t topologyRevision = 1;        ///< triangles, uvs or counts changed
    uint64_t pointsRevision = 1;          ///< positions or normals changed
    std::shared_ptr<const MeshBvh> bvh;   ///< built before, for these revisions; none: the tracer builds it
};

enum class ColorSpace { Linear, Srgb, Auto };
enum class Wrap { Repeat, Clamp, Mirror, Black };

/// Pixels, float RGBA or 8-bit RGBA, row 0 at the top as files store it. st (0,0) is the lower left corner.
struct Texture {
    std::string name; ///< file path, for messages
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgba8; ///< either this, sRGB- or linear-encoded by `srgb`
    std::vector<float> rgba32f; ///< or this, linear
    bool srgb = false;
    Wrap wrapS = Wrap::Repeat, wrapT = Wrap::Repeat;
    uint64_t revision = 1;
};

/// How a material input reads a texture: value = texel * scale + bias, at st = uvTransform * (s, t, 1).
struct TextureInput {
    TextureId texture = TextureId::None;
    int channel = -1; ///< -1: rgb; 0..3: one channel
    glm::vec4 scale{1}, bias{0};
    glm::mat3x2 uvTransform{1, 0, 0, 1, 0, 0}; ///< columns: du, dv, offset
};

/// One layered surface model that UsdPreviewSurface, standard_surface and OpenPBR map onto.
/// Colours are linear Rec. 709; roughness is perceptual (alpha = roughness^2); emission is radiance in W/(m^2 sr),
/// sent out on the front side of the geometric normal.
struct Material {
    std::string name;
    glm::vec3 baseColor{0.18f};
    float metallic = 0;
    float roughness = 0.5f;
    float ior = 1.5f;              ///< 1 with metallic 0: no specular lobe
    float specular = 1;            ///< weight of the dielectric specular lobe (standard_surface `specular`)
    glm::vec3 specularColor{1};    ///< tint of the dielectric F0; in the specular workflow F0 itself
    bool specularWorkflow = false; ///< UsdPreviewSurface useSpecularWorkflow = 1: F0 = specularColor, metallic ignored
    float transmission = 0;        ///< share of the base that refracts (dielectric), tinted by transmissionColor
    glm::vec3 transmissionColor{1};
    float clearcoat = 0, clearcoatRoughness = 0.01f, clearcoatIor = 1.5f;
    glm::vec3 emission{0};
    float opacity = 1;          ///< presence (cut-out); dielectrics carry 1 here and use `transmission`
    float opacityThreshold = 0; ///< above 0: opacity below it is cut out, else fully present
    TextureInput baseColorMap, metallicMap, roughnessMap, emissionMap, opacityMap, normalMap, specularColorMap,
        clearcoatMap, clearcoatRoughnessMap, transmissionMap;
    uint64_t revision = 1;
};

// ---- Components --------------------------------------------------------------------------------

/// Prim path or the application's name for the entity; also the source of stable light ids.
struct Name {
    std::string path;
};

struct Parent {
    Entity entity;
};

struct LocalTransform {
    glm::dmat4 parentFromLocal{1};
};

/// Derived by Scene::updateTransforms from LocalTransform and Parent, with last frame's value for motion.
struct WorldTransform {
    glm::dmat4 worldFromLocal{1};
    glm::dmat4 previousWorldFromLocal{1};
};

/// Absent: visible. Inherited by children.
struct Visibility {
    bool visible = true;
    bool camera = true; ///< seen by primary rays
    bool shadow = true; ///< blocks light
};

/// Derived by Scene::updateTransforms for every entity with a LocalTransform: its own Visibility and its ancestors'.
struct InheritedVisibility {
    bool visible = true, camera = true, shadow = true;
    bool operator==(const InheritedVisibility&) const = default;
};

struct MeshInstance {
    MeshId mesh = MeshId::None;
    std::vector<MaterialId> materials; ///< by subset; a missing entry uses the default material
};

/// An exact sphere of radius 1 in local space, scaled by the transform.
struct SphereInstance {
    float radius = 1;
    MaterialId material = MaterialId::None;
};

enum class LightKind : uint32_t { Rect, Disk, Sphere, Cylinder, Distant, Dome };

/// UsdLux meaning: lies in local space as the schema says (rect, disk: in the xy plane, emitting along -Z; cylinder
/// along X; distant: emits along -Z; dome: texture's pole along +Y, latlong).
/// Mesh lights have no Light component: they are MeshInstances with emissive materials.
struct Light {
    LightKind kind = LightKind::Rect;
    glm::vec3 radiance{1};       ///< W/(m^2 sr) after intensity, exposure, color, temperature and normalize.
                                 ///< Distant with angle 0: irradiance on a facing surface, W/m^2.
    float width = 1, height = 1; ///< rect
    float radius = 0.5f;         ///< disk, sphere, cylinder
    float length = 1;            ///< cylinder
    float angle = 0.53f;         ///< distant: apparent diameter, degrees
    bool normalize = false;      ///< divide by world-space area (distant: by the solid angle), done at extraction
    TextureId texture = TextureId::None; ///< rect, dome
    bool visibleToCamera = true;
};

struct Camera {
    float verticalAperture = 15.2908f, horizontalAperture = 20.955f;      ///< mm
    float horizontalOffset = 0, verticalOffset = 0;                       ///< mm
    float focalLength = 50;                                               ///< mm
    float nearClip = 0, farClip = std::numeric_limits<float>::infinity(); ///< metres
    float fStop = 0;                                                      ///< 0: pinhole
    float focusDistance = 0;                                              ///< metres
};

} // namespace trilume
