// The compute tracer's structures: our own BVH, built on the CPU.
#include "gpu/device_table.h"
#include "rt/accel_backend.h"

#include <algorithm>
#include <utility>

namespace trilume::rt {
namespace {

/// Refitting goes on while a ray's expected cost stays within this factor of the built structure's.
constexpr float kDecay = 1.5f;
constexpr BvhOptions kTopOptions{.maxDepth = shared::kBvhTopDepth, .maxLeafSize = 1};

class ComputeBackend final : public AccelBackend {
public:
    explicit ComputeBackend(gpu::Device& device) : device_(device) {}

    void beginUpdate() override { retired_.clear(); }

    bool build(uint32_t slot, const MeshInput& mesh) override {
        if (slot >= meshes_.size()) meshes_.resize(slot + 1);
        Mesh& m = meshes_[slot];
        m.bvh = mesh.built ? *mesh.built : buildBvh(mesh.usable.boxes, {}, TaskPool::shared());
        m.builtCost = m.bvh.cost;
        upload(m, mesh);
        if (!mesh.deforming) m.bvh = {};
        return !mesh.built;
    }

    bool refit(uint32_t slot, const MeshInput& mesh) override {
        Mesh& m = meshes_[slot];
        refitBvh(m.bvh, mesh.usable.boxes, {});
        if (m.bvh.cost > kDecay * m.builtCost) return false;
        upload(m, mesh);
        return true;
    }

    void remove(uint32_t slot) override {
        Mesh& m = meshes_[slot];
        retired_.push_back(std::move(m.nodes.current));
        retired_.push_back(std::move(m.triangles.current));
        m = {};
    }

    MeshAccelAddresses addresses(uint32_t slot) const override {
        return {meshes_[slot].nodes.current.address(), meshes_[slot].triangles.current.address()};
    }

    void buildTop(std::span<const PlacedInstance> instances) override {
        std::vector<Box> boxes;
        std::vector<uint32_t> indices;
        boxes.reserve(instances.size());
        indices.reserve(instances.size());
        for (const PlacedInstance& instance : instances) {
            boxes.push_back(instance.bounds);
            indices.push_back(instance.index);
        }
        const bool kept = indices == topIndices_ && !indices.empty();
        if (kept) {
            std::vector<uint8_t> moved(boxes.size());
            for (size_t i = 0; i < boxes.size(); ++i) moved[i] = boxes[i] != topBoxes_[i] ? 1 : 0;
            refitBvh(top_, boxes, kTopOptions, moved);
        }
        topBoxes_ = std::move(boxes);
        if (!kept || topDecayed()) {
            top_ = buildBvh(topBoxes_, kTopOptions, TaskPool::shared());
            builtTopCost_ = top_.cost;
            std::vector<uint32_t> order = top_.order;
            for (uint32_t& index : order) index = indices[index];
            topInstances_.assign(device_, std::move(order));
            topIndices_ = std::move(indices);
        }
        topNodes_.assign(device_, top_.nodes);
    }

    bool moveTop(std::span<const PlacedInstance> instances) override {
        std::vector<uint8_t> moved(topBoxes_.size());
        for (const PlacedInstance& instance : instances) {
            const auto place = std::ranges::lower_bound(topIndices_, instance.index) - topIndices_.begin();
            topBoxes_[place] = instance.bounds;
            moved[place] = 1;
        }
        refitBvh(top_, topBoxes_, kTopOptions, moved);
        if (topDecayed()) return false;
        topNodes_.assign(device_, top_.nodes);
        return true;
    }

    void use(bool) override {} // the scene tables name their structures

    VkDeviceAddress topNodes() const override { return topNodes_.address(); }
    VkDeviceAddress topInstances() const override { return topInstances_.address(); }

private:
    /// Updates take turns, so that the last one's data outlives the next.
    struct Pair {
        gpu::Buffer current, other;
    };
    struct Mesh {
        Bvh bvh; ///< kept for deforming meshes
        float builtCost = 0.0f;
        Pair nodes, triangles;
    };

    bool topDecayed() const { return top_.cost > kDecay * builtTopCost_; }

    void upload(Mesh& m, const MeshInput& mesh) {
        std::vector<shared::LeafTriangle> triangles(m.bvh.order.size());
        TaskPool::shared().parallelFor(triangles.size(), 1 << 15, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const uint32_t triangle = m.bvh.order[i];
                const glm::uvec3 corners = mesh.triangles[triangle];
                triangles[i] = {mesh.positions[corners.x], mesh.positions[corners.y], mesh.positions[corners.z],
                                triangle};
            }
        });
        store<shared::BvhNode>(m.nodes, m.bvh.nodes, mesh.name);
        store<shared::LeafTriangle>(m.triangles, triangles, mesh.name);
    }

    /// Puts the data into the other buffer, or into a new one where it does not fit.
    template<class T>
    void store(Pair& pair, std::span<const T> data, std::string_view what) {
        std::swap(pair.current, pair.other);
        gpu::Buffer& buffer = pair.current;
        if (data.size_bytes() > buffer.size() || !buffer) {
            buffer = device_.createBuffer(data.size_bytes(), gpu::Memory::Device, what);
        }
        if (!data.empty()) device_.upload(buffer, 0, std::as_bytes(data));
    }

    gpu::Device& device_;
    std::vector<Mesh> meshes_;
    Bvh top_;                          ///< over topIndices_
    std::vector<uint32_t> topIndices_; ///< of the instances that can be hit, ascending
    std::vector<Box> topBoxes_;        ///< around them
    float builtTopCost_ = 0.0f;
    gpu::DeviceTable<shared::BvhNode> topNodes_{"top-level BVH"};
    gpu::DeviceTable<uint32_t> topInstances_{"instances of the top-level BVH"};
    std::vector<gpu::Buffer> retired_;
};

} // namespace

std::unique_ptr<AccelBackend> createComputeBackend(gpu::Device& device) {
    return std::make_unique<ComputeBackend>(device);
}

} // namespace trilume::rt
