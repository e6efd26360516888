#pragma once

#include "ecs/world.h"
#include "scene/bounds.h"
#include "scene/components.h"
#include "scene/hierarchy.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trilume {

/// What a stage says about how to render it; flags override.
struct RenderSettings {
    std::string camera;             ///< prim path; empty: none
    uint32_t width = 0, height = 0; ///< 0: none
};

/// Re-reads what varies with time. Implemented by scene readers; held by the scene they filled.
class SceneSource {
public:
    virtual ~SceneSource() = default;
    /// Writes only components and assets whose value at `timeCode` differs from the present one.
    virtual void setTime(double timeCode) = 0;
    /// In order: where something is said. Between two of them values go smoothly or not at all.
    virtual std::vector<double> sampleTimes() const = 0;
};

/// Entities with components, the assets that they name, and where time comes from. World space is Y up, in metres.
class Scene {
public:
    World world;

    MeshId addMesh(Mesh mesh);
    MaterialId addMaterial(Material material);
    TextureId addTexture(Texture texture);
    const Mesh& mesh(MeshId id) const { return meshes_[static_cast<uint32_t>(id)]; }
    const Material& material(MaterialId id) const { return materials_[static_cast<uint32_t>(id)]; }
    const Texture& texture(TextureId id) const { return textures_[static_cast<uint32_t>(id)]; }
    /// For writing; the caller says what changed by growing the revision fields.
    Mesh& editMesh(MeshId id) { return meshes_[static_cast<uint32_t>(id)]; }
    /// For writing; grows the revision.
    Material& editMaterial(MaterialId id);
    Texture& editTexture(TextureId id);
    std::span<const Mesh> meshes() const { return meshes_; }
    std::span<const Material> materials() const { return materials_; }
    std::span<const Texture> textures() const { return textures_; }

    /// Creates an entity with Name, LocalTransform, and Parent when given.
    Entity createEntity(std::string path, glm::dmat4 parentFromLocal = glm::dmat4(1), Entity parent = {});

    /// Derives WorldTransform and InheritedVisibility from what changed since the last call, once per frame: last
    /// frame's worldFromLocal moves into previousWorldFromLocal. Returns the number of entities visited.
    size_t updateTransforms() { return hierarchy_.update(world); }
    /// False when the entity or an ancestor is hidden. Valid after updateTransforms.
    bool isVisible(Entity entity) const;

    /// World bounds of visible meshes, spheres and finite lights; points that are not finite don't count. Meshes
    /// contribute the box around their transformed local box. Valid after updateTransforms.
    Bounds bounds() const { return bounds_.update(*this); }

    /// Moves the scene to `timeCode`; without a source it does nothing.
    void setTime(double timeCode);

    std::string path;                         ///< the file, for messages
    std::optional<double> startTime, endTime; ///< time codes; absent when the stage has none
    double timeCodesPerSecond = 24;
    RenderSettings renderSettings;
    std::unique_ptr<SceneSource> source;

private:
    std::vector<Mesh> meshes_;
    std::vector<Material> materials_;
    std::vector<Texture> textures_;
    Hierarchy hierarchy_;
    mutable SceneBounds bounds_; ///< keeps what it measured
};

/// Whether anything emits: a Light, or a visible mesh or sphere with an emissive material. Valid after
/// updateTransforms.
bool hasLight(const Scene& scene);

/// What lights a stage without a light: a neutral dome of radiance 1 W/(m^2 sr).
Entity addDefaultLight(Scene& scene);

/// The camera entity that `name` means (prim path or last path component); an empty name: the only camera, else the
/// render settings', else one is created that looks along -Z and frames the bounds, said in one log line.
/// Throws inputError listing the cameras when the name is unknown or means several.
Entity chooseCamera(Scene& scene, std::string_view name);

} // namespace trilume
