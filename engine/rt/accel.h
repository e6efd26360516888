#pragma once

#include "gpu/device.h"
#include "shared/scene.h"

#include <glm/glm.hpp>

#include <memory>
#include <span>
#include <string_view>

namespace trilume::rt {

/// A mesh's acceleration structure in a SceneAccel.
struct MeshAccelId {
    uint32_t slot = shared::kNone;
    explicit operator bool() const { return slot != shared::kNone; }
    friend bool operator==(MeshAccelId, MeshAccelId) = default;
};

/// Device addresses for shared::Mesh; 0 with the query tracer.
struct MeshAccelAddresses {
    VkDeviceAddress nodes = 0;         ///< shared::BvhNode
    VkDeviceAddress leafTriangles = 0; ///< shared::LeafTriangle
};

/// One entry of the scene's instance table, in the table's order.
struct InstanceInput {
    uint32_t shape = shared::kShapeMesh; ///< shared::kShape*
    MeshAccelId mesh;                    ///< of kShapeMesh; none: the instance can't be hit
    glm::mat4x3 worldFromLocal{1.0f};
    uint32_t mask = shared::kMaskAll;
    friend bool operator==(const InstanceInput&, const InstanceInput&) = default;
};

/// Triangles of a mesh that no ray can hit.
struct MeshAccelReport {
    uint32_t invalid = 0;    ///< corners that are not finite, or indices out of range
    uint32_t degenerate = 0; ///< without area
};

/// What was done since beginUpdate().
struct AccelStats {
    uint32_t blasBuilt = 0, blasRefit = 0;
    uint32_t tlasBuilt = 0; ///< or refit, where instances only moved
    double buildMs = 0.0;   ///< on the calling thread
};

class AccelBackend;
struct Bvh;

/// All acceleration data of a scene, for the tracer that was chosen and no other. Call it between frames, not while
/// recording: it uploads and, for the query tracer, submits builds. What frames under way still use stays alive.
class SceneAccel {
public:
    /// Auto takes `query` on GPUs that have it, else `compute`. Throws inputError for Query on a device without.
    SceneAccel(gpu::Device& device, gpu::Tracer tracer);
    ~SceneAccel();
    SceneAccel(const SceneAccel&) = delete;
    SceneAccel& operator=(const SceneAccel&) = delete;

    gpu::Tracer tracer() const { return tracer_; }

    /// Builds the structure of one mesh (three corner indices a triangle, local metres). `deforming` keeps what
    /// refitting needs; `name` appears in errors. Triangles that can't be hit are left out, see report(). `built`: what
    /// buildBvh makes of the mesh, to save the compute tracer that work; it isn't checked.
    MeshAccelId addMesh(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles, bool deforming,
                        std::string_view name, const Bvh* built = nullptr);
    /// New positions for the same triangles: refits deforming meshes while the expected cost of a ray stays within 1.5
    /// times that of the last build, else builds anew. The addresses may change. Call setInstances afterwards.
    void updateMesh(MeshAccelId id, std::span<const glm::vec3> positions);
    void removeMesh(MeshAccelId id);
    MeshAccelAddresses addresses(MeshAccelId id) const;
    MeshAccelReport report(MeshAccelId id) const;

    /// Builds the top level, or refits it, when an instance or one of the meshes changed since the last call. Instances
    /// whose transform has no inverse, and meshes without triangles, can't be hit. Throws inputError for more than 4^11
    /// instances.
    void setInstances(std::span<const InstanceInput> instances);
    /// The same where since then only transforms have changed, and only of the instances at `moved`.
    void moveInstances(std::span<const InstanceInput> instances, std::span<const uint32_t> moved);
    /// Makes this scene the one that ray queries of the next submission trace: a device knows one at a time.
    /// `previous`: last frame's structure is that before the last update, else this one.
    void use(bool previous = false) const;
    /// Device addresses for shared::SceneTable; 0 with the query tracer.
    VkDeviceAddress topNodes() const;
    VkDeviceAddress topInstances() const;

    /// Counts anew from here. What the structures were until now stays in place through this update, for frames that
    /// look back.
    void beginUpdate();
    const AccelStats& stats() const;

private:
    struct Mesh;
    struct State;
    gpu::Tracer tracer_;
    std::unique_ptr<State> state_;
};

} // namespace trilume::rt
