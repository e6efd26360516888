#pragma once

#include "gpu/device_table.h"
#include "graph/graph.h"
#include "light/light_table.h"
#include "render/casters.h"
#include "render/gpu_materials.h"
#include "rt/accel.h"
#include "scene/scene.h"
#include "shared/scene.h"

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <unordered_map>

namespace trilume {

/// The device's copy of one scene; follows changes only.
class GpuScene {
public:
    GpuScene(gpu::Device& device, gpu::Tracer tracer, Scene& scene);

    /// Brings transforms, assets, instances, lights and acceleration structures up to date.
    void update();

    /// Before each submission that traces rays; `previous`: what last frame traced is last update's, else it is this
    /// one's.
    void use(bool previous) const { accel_.use(previous); }

    Scene& scene() { return scene_; }
    /// Render space is world space minus this.
    glm::dvec3 origin() const { return origin_; }
    const shared::SceneTable& table() const { return table_; }
    /// Bits of the kinds of light that there are, or were: kernels are made for them.
    uint32_t lightKinds() const { return lightKinds_; }
    /// Likewise whether rects or domes have, or had, textures.
    bool texturedLights() const { return texturedLights_; }
    /// As it was before the last update; what it names stays until the next one.
    const shared::SceneTable& previousTable() const { return previousTable_; }
    /// Whether the last update changed the places of lights in the table, and where they went: of each light in
    /// previousTable() its index in table(), and the reverse; kNone where it was removed or added.
    bool lightsRenumbered() const { return lightsRenumbered_; }
    VkDeviceAddress currentLight() const { return currentLight_.address(); }
    VkDeviceAddress previousLight() const { return previousLight_.address(); }
    const graph::SceneFacts& facts() const { return facts_; }
    const GpuMaterials& materials() const { return materials_; }
    /// Of the last update.
    const rt::AccelStats& accelStats() const { return accel_.stats(); }
    /// Grows with each update that found a change, and with the first that finds none: the facts differ.
    uint64_t revision() const { return revision_; }

private:
    struct DeviceMesh {
        rt::MeshAccelId accel{};
        gpu::Buffer triangles, positions, normals, uvs, subsets;
        std::vector<Ball> balls; ///< of its subsets
        uint64_t topologyRevision = 0, pointsRevision = 0;
        bool present = false;
    };
    /// Instances under construction, with what they bring to the light table and the tracer.
    struct Draft {
        std::vector<shared::Instance> instances;
        std::vector<rt::InstanceInput> traced;
        std::vector<uint32_t> materialIndices;
        std::deque<Light> emitters; ///< lights that no component holds: emissive spheres
        std::vector<LightInput> lights;
        std::vector<EmissiveMeshInput> emissive;
    };

    void followChanges();
    bool updateMeshes();
    void updateMesh(const Mesh& mesh, DeviceMesh& device);
    void updateInstances();
    /// Where nothing but the places of things without light changed since the last update, updates just those; else
    /// does nothing and returns false.
    bool moveInstances();
    /// How many there are of each kind of component that instances are made from.
    std::array<uint64_t, 6> turnovers() const;
    bool onlyTransformsChanged() const;
    void updateTable(const Bounds& bounds);
    void place(shared::Instance& instance, rt::InstanceInput& traced, const WorldTransform& transform,
               const glm::dmat4& localFromShape) const;
    uint32_t addInstance(Draft& draft, Entity entity, uint32_t shape, uint32_t mesh, const glm::dmat4& localFromShape,
                         std::span<const uint32_t> materials, uint32_t mask);
    void addMeshes(Draft& draft);
    void addSpheres(Draft& draft);
    void addLights(Draft& draft);
    /// When it moves, lights do.
    void markLit(Entity entity);
    void addLight(Draft& draft, const Light& light, const glm::dmat4& worldFromLocal, uint32_t instance, Entity owner);
    void updateFacts(const Draft& draft);
    /// Balls around what casts caustics; counts them.
    std::vector<shared::Caster> findCasters(std::span<const shared::Instance> instances,
                                            std::span<const uint32_t> materialIndices);
    struct LightTexture;
    /// The texture's importance-sampled density, with its index in the device's table; null without a texture.
    const LightTexture* lightTexture(TextureId texture, LightKind kind, uint32_t& distribution);
    uint32_t stableId(Entity entity, uint32_t count);
    void matchLights(std::span<const shared::Light> previous, std::span<const shared::Light> current);
    /// Keeps the old buffer for the frame that looks back.
    void replace(gpu::Buffer& buffer, gpu::Buffer replacement);

    gpu::Device& device_;
    Scene& scene_;
    GpuMaterials materials_;
    rt::SceneAccel accel_;
    glm::dvec3 origin_{0};
    std::optional<Tick> seen_;
    bool complete_ = false; ///< the last update did not fail
    uint64_t revision_ = 0;

    std::vector<DeviceMesh> meshes_;
    gpu::DeviceTable<shared::Mesh> meshTable_{"meshes"};
    gpu::DeviceTable<shared::Instance> instances_{"instances"};
    gpu::DeviceTable<uint32_t> materialIndices_{"material indices"};
    gpu::DeviceTable<shared::Light> lights_{"lights"};
    gpu::DeviceTable<shared::AliasEntry> alias_{"light alias table"};
    gpu::DeviceTable<uint32_t> lightOfTriangle_{"lights of triangles"};
    gpu::DeviceTable<shared::Distribution> distributions_{"light distributions"};
    gpu::DeviceTable<shared::Caster> casters_{"casters of caustics"};

    struct LightTexture {
        uint64_t revision = 0;
        gpu::Buffer marginal, conditional, density;
        shared::Distribution record{};
        glm::vec3 mean{0};
    };
    std::map<std::pair<TextureId, LightKind>, LightTexture> lightTextures_;
    std::vector<shared::Distribution> usedDistributions_;
    /// Lights keep their ids from frame to frame; an emissive mesh takes one for each triangle.
    std::unordered_map<uint64_t, std::pair<uint32_t, uint32_t>> lightIds_;
    uint32_t nextLightId_ = 0;
    uint32_t lightKinds_ = 0;
    bool texturedLights_ = false;
    bool lightsRenumbered_ = false;
    gpu::DeviceTable<uint32_t> currentLight_{"lights since last frame"};
    gpu::DeviceTable<uint32_t> previousLight_{"lights in last frame"};

    std::vector<rt::InstanceInput> traced_; ///< beside instances_
    std::vector<uint32_t> instanceOf_;      ///< by index of the entity: its instance, kNone, or kLit
    std::array<uint64_t, 6> turnovers_{};   ///< at the last updateInstances()

    std::vector<gpu::Buffer> retired_; ///< of meshes, in last update
    shared::SceneTable table_{}, previousTable_{};
    graph::SceneFacts facts_;
};

} // namespace trilume
