#pragma once

#include "rt/accel.h"
#include "rt/bvh.h"

#include <string>

namespace trilume::rt {

struct MeshInput {
    std::span<const glm::vec3> positions;
    std::span<const glm::uvec3> triangles;
    const TriangleInput& usable;
    bool deforming;
    const std::string& name;
    const Bvh* built; ///< over these triangles at these positions; null: not yet
};

/// An instance that can be hit.
struct PlacedInstance {
    uint32_t index; ///< in the scene's table
    const InstanceInput* input;
    Box bounds; ///< world
};

/// What differs between the tracers. Slots are chosen by the caller; a build replaces what the slot held.
class AccelBackend {
public:
    virtual ~AccelBackend() = default;
    /// What was replaced before this may go; what is replaced from here on stays until the next call.
    virtual void beginUpdate() = 0;
    /// False when what was built before serves.
    virtual bool build(uint32_t slot, const MeshInput& mesh) = 0;
    /// The same triangles with new positions; false, with the slot unchanged in use, when building anew is due.
    virtual bool refit(uint32_t slot, const MeshInput& mesh) = 0;
    virtual void remove(uint32_t slot) = 0;
    virtual MeshAccelAddresses addresses(uint32_t slot) const = 0;
    virtual void buildTop(std::span<const PlacedInstance> instances) = 0;
    /// Of the instances of the last buildTop these have other bounds; false when it is to be called in place of this.
    virtual bool moveTop(std::span<const PlacedInstance> /*instances*/) { return false; }
    virtual void use(bool previous) = 0;
    virtual VkDeviceAddress topNodes() const = 0;
    virtual VkDeviceAddress topInstances() const = 0;
};

std::unique_ptr<AccelBackend> createComputeBackend(gpu::Device& device);
std::unique_ptr<AccelBackend> createQueryBackend(gpu::Device& device);

} // namespace trilume::rt
