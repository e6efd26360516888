// The query tracer's structures: VkAccelerationStructureKHR, built by the device.
#include "gpu/result.h"
#include "rt/accel_backend.h"

#include <algorithm>
#include <array>
#include <utility>

namespace trilume::rt {
namespace {

constexpr VkBufferUsageFlags kBuildInput = VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR;
/// Drivers tell nothing of a structure's quality, so deforming meshes are built anew after this many refits.
constexpr uint32_t kRefitsPerBuild = 16;
/// Builds of one batch share scratch memory up to about this size, and run side by side.
constexpr size_t kScratchBytes = size_t(64) << 20;
constexpr uint32_t kShapes = 4; // kShapeSphere to kShapeCylinder

struct Functions {
    PFN_vkCreateAccelerationStructureKHR create;
    PFN_vkDestroyAccelerationStructureKHR destroy;
    PFN_vkGetAccelerationStructureBuildSizesKHR sizes;
    PFN_vkCmdBuildAccelerationStructuresKHR build;
    PFN_vkGetAccelerationStructureDeviceAddressKHR address;

    explicit Functions(VkDevice device) {
        load(device, create, "vkCreateAccelerationStructureKHR");
        load(device, destroy, "vkDestroyAccelerationStructureKHR");
        load(device, sizes, "vkGetAccelerationStructureBuildSizesKHR");
        load(device, build, "vkCmdBuildAccelerationStructuresKHR");
        load(device, address, "vkGetAccelerationStructureDeviceAddressKHR");
    }
    template<class F>
    static void load(VkDevice device, F& function, const char* name) {
        function = reinterpret_cast<F>(vkGetDeviceProcAddr(device, name));
    }
};

/// One acceleration structure with its memory; destroyed when the device is done with it.
class Structure {
public:
    Structure() = default;
    Structure(gpu::Device& device, const Functions& functions, VkAccelerationStructureTypeKHR type, size_t bytes,
              std::string_view what)
        : device_(&device), destroy_(functions.destroy),
          buffer_(device.createBuffer(bytes, gpu::Memory::Device, what,
                                      VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR)) {
        VkAccelerationStructureCreateInfoKHR info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
        info.buffer = buffer_.handle();
        info.size = bytes;
        info.type = type;
        gpu::check(functions.create(device.handle(), &info, nullptr, &handle_), "vkCreateAccelerationStructureKHR");
        VkAccelerationStructureDeviceAddressInfoKHR of{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
        of.accelerationStructure = handle_;
        address_ = functions.address(device.handle(), &of);
    }
    Structure(Structure&& other) noexcept { swap(other); }
    Structure& operator=(Structure&& other) noexcept {
        swap(other);
        return *this;
    }
    ~Structure() {
        if (!handle_) return;
        device_->destroyLater(
            [destroy = destroy_, device = device_->handle(), handle = handle_] { destroy(device, handle, nullptr); });
    }

    explicit operator bool() const { return handle_ != VK_NULL_HANDLE; }
    VkAccelerationStructureKHR handle() const { return handle_; }
    VkDeviceAddress address() const { return address_; }
    size_t size() const { return buffer_.size(); }

private:
    void swap(Structure& other) {
        std::swap(device_, other.device_);
        std::swap(destroy_, other.destroy_);
        std::swap(handle_, other.handle_);
        std::swap(address_, other.address_);
        std::swap(buffer_, other.buffer_);
    }

    gpu::Device* device_ = nullptr;
    PFN_vkDestroyAccelerationStructureKHR destroy_ = nullptr;
    VkAccelerationStructureKHR handle_ = VK_NULL_HANDLE;
    VkDeviceAddress address_ = 0;
    gpu::Buffer buffer_; ///< retired after the handle: members go after the destructor's body
};

/// A build to be recorded: geometry of one kind.
struct Build {
    VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
    VkAccelerationStructureBuildGeometryInfoKHR info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
    uint32_t primitives = 0;
    size_t scratchBytes = 0;
};

class QueryBackend final : public AccelBackend {
public:
    explicit QueryBackend(gpu::Device& device) : device_(device), functions_(device.handle()) {
        VkPhysicalDeviceAccelerationStructurePropertiesKHR limits{
            VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
        VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &limits};
        vkGetPhysicalDeviceProperties2(device.physicalDevice(), &properties);
        scratchAlignment_ = std::max<size_t>(limits.minAccelerationStructureScratchOffsetAlignment, 1);
    }

    ~QueryBackend() override { device_.setTopLevel(VK_NULL_HANDLE, VK_NULL_HANDLE); }

    void beginUpdate() override {
        if (queued_.empty()) retired_.clear(); // after a failed submission, refits still need what they start from
        previousTop_ = {};
    }

    bool build(uint32_t slot, const MeshInput& mesh) override {
        dequeue(slot); // of a structure that goes away
        if (slot >= meshes_.size()) meshes_.resize(slot + 1);
        Mesh& m = meshes_[slot];
        retired_.push_back(std::move(m.structure));
        m = {};
        if (mesh.usable.usable == 0) return true;
        // What can't be hit keeps its number, as a triangle without area.
        std::vector<glm::uvec3> triangles(mesh.triangles.begin(), mesh.triangles.end());
        for (size_t i = 0; i < triangles.size(); ++i) {
            if (mesh.usable.boxes[i].empty()) triangles[i] = glm::uvec3(0);
        }
        m.vertices = device_.createBufferFrom<glm::vec3>(cleaned(mesh.positions), mesh.name, kBuildInput);
        m.indices = device_.createBufferFrom<glm::uvec3>(triangles, mesh.name, kBuildInput);
        m.vertexCount = static_cast<uint32_t>(mesh.positions.size());
        m.triangleCount = static_cast<uint32_t>(triangles.size());
        m.deforming = mesh.deforming;

        Build build = meshBuild(m);
        m.structure = make(build, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, mesh.name, m.updateScratch);
        queue(slot, build);
        return true;
    }

    bool refit(uint32_t slot, const MeshInput& mesh) override {
        Mesh& m = meshes_[slot];
        if (!m.structure || m.vertexCount != mesh.positions.size() || m.refits == kRefitsPerBuild) return false;
        ++m.refits;
        const std::vector<glm::vec3> positions = cleaned(mesh.positions);
        device_.upload(m.vertices, 0, std::as_bytes(std::span(positions)));
        if (isQueued(slot)) return true; // its build will see the new positions
        Build build = meshBuild(m);
        // Into a structure of its own: last frame's stays as it was.
        Structure refitted = make(build, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, mesh.name, m.updateScratch);
        build.info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR;
        build.info.srcAccelerationStructure = m.structure.handle();
        build.scratchBytes = m.updateScratch;
        retired_.push_back(std::exchange(m.structure, std::move(refitted)));
        queue(slot, build);
        return true;
    }

    void remove(uint32_t slot) override {
        dequeue(slot);
        retired_.push_back(std::move(meshes_[slot].structure));
        meshes_[slot] = {};
    }

    MeshAccelAddresses addresses(uint32_t) const override { return {}; }

    void buildTop(std::span<const PlacedInstance> instances) override {
        std::vector<VkAccelerationStructureInstanceKHR> records;
        records.reserve(instances.size());
        for (const PlacedInstance& placed : instances) records.push_back(instanceRecord(placed));
        const std::span<const VkAccelerationStructureInstanceKHR> data(records);
        if (!instances_ || data.size_bytes() > instances_.size()) {
            instances_ =
                device_.createBuffer(data.size_bytes(), gpu::Memory::Device, "top-level structure", kBuildInput);
        }
        if (!data.empty()) device_.upload(instances_, 0, std::as_bytes(data));

        Build build;
        build.geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
        build.geometry.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
        build.geometry.geometry.instances.data.deviceAddress = instances_.address();
        build.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR;
        build.info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        build.primitives = static_cast<uint32_t>(records.size());
        size_t updateScratch = 0;
        if (top_) previousTop_ = std::move(top_);
        top_ = make(build, build.info.type, "top-level structure", updateScratch);
        submit(build);
        use(false);
    }

    void use(bool previous) override {
        device_.setTopLevel(top_.handle(), previous && previousTop_ ? previousTop_.handle() : top_.handle());
    }

    VkDeviceAddress topNodes() const override { return 0; }
    VkDeviceAddress topInstances() const override { return 0; }

private:
    struct Mesh {
        Structure structure; ///< none: no triangle can be hit
        gpu::Buffer vertices, indices;
        uint32_t vertexCount = 0, triangleCount = 0, refits = 0;
        size_t updateScratch = 0;
        bool deforming = false;
    };
    struct Queued {
        uint32_t slot;
        Build build;
    };

    /// Positions that are not finite belong to triangles left out, but drivers may look at every vertex.
    static std::vector<glm::vec3> cleaned(std::span<const glm::vec3> positions) {
        std::vector<glm::vec3> result(positions.begin(), positions.end());
        for (glm::vec3& p : result) {
            if (!(glm::dot(p, p) <= std::numeric_limits<float>::max())) p = glm::vec3(0);
        }
        return result;
    }

    static Build meshBuild(const Mesh& m) {
        Build build;
        auto& triangles = build.geometry.geometry.triangles;
        build.geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
        build.geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
        triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
        triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
        triangles.vertexData.deviceAddress = m.vertices.address();
        triangles.vertexStride = sizeof(glm::vec3);
        triangles.maxVertex = m.vertexCount - 1;
        triangles.indexType = VK_INDEX_TYPE_UINT32;
        triangles.indexData.deviceAddress = m.indices.address();
        build.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
        build.info.flags = m.deforming ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR |
                                             VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR
                                       : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        build.primitives = m.triangleCount;
        return build;
    }

    /// Makes the structure that `build` will fill, and completes `build`.
    Structure make(Build& build, VkAccelerationStructureTypeKHR type, std::string_view what, size_t& updateScratch) {
        build.info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
        build.info.geometryCount = 1;
        build.info.pGeometries = &build.geometry;
        VkAccelerationStructureBuildSizesInfoKHR sizes{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
        functions_.sizes(device_.handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &build.info,
                         &build.primitives, &sizes);
        Structure structure(device_, functions_, type, sizes.accelerationStructureSize, what);
        build.info.dstAccelerationStructure = structure.handle();
        build.scratchBytes = sizes.buildScratchSize;
        updateScratch = sizes.updateScratchSize;
        return structure;
    }

    bool isQueued(uint32_t slot) const {
        return std::ranges::any_of(queued_, [slot](const Queued& q) { return q.slot == slot; });
    }
    void dequeue(uint32_t slot) {
        std::erase_if(queued_, [slot](const Queued& q) { return q.slot == slot; });
    }
    void queue(uint32_t slot, const Build& build) {
        dequeue(slot);
        queued_.push_back({slot, build});
    }

    VkAccelerationStructureInstanceKHR instanceRecord(const PlacedInstance& placed) {
        const InstanceInput& input = *placed.input;
        VkAccelerationStructureInstanceKHR record{};
        const glm::mat3x4 rows = glm::transpose(input.worldFromLocal);
        std::copy_n(&rows[0].x, 12, &record.transform.matrix[0][0]);
        record.instanceCustomIndex = placed.index;
        record.mask = input.mask & 0xffu;
        record.instanceShaderBindingTableRecordOffset = input.shape;
        record.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
        record.accelerationStructureReference =
            input.shape == shared::kShapeMesh ? meshes_[input.mesh.slot].structure.address() : shape(input.shape);
        return record;
    }

    /// The structure of a unit shape: one box, made when the first instance needs it.
    VkDeviceAddress shape(uint32_t shape) {
        Structure& structure = shapes_[shape - shared::kShapeSphere];
        if (structure) return structure.address();
        if (!shapeBoxes_) {
            // A little wider than the shapes, so that rounding in the box test does not matter.
            constexpr float w = 1.01f, h = 0.51f, flat = 0.01f;
            const std::array<VkAabbPositionsKHR, kShapes> boxes{{
                {-w, -w, -w, w, w, w},
                {-h, -h, -flat, h, h, flat},
                {-w, -w, -flat, w, w, flat},
                {-h, -w, -w, h, w, w},
            }};
            shapeBoxes_ = device_.createBufferFrom<VkAabbPositionsKHR>(boxes, "unit shapes", kBuildInput);
        }
        Build build;
        build.geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_KHR;
        build.geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
        build.geometry.geometry.aabbs = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR};
        build.geometry.geometry.aabbs.data.deviceAddress =
            shapeBoxes_.address() + (shape - shared::kShapeSphere) * sizeof(VkAabbPositionsKHR);
        build.geometry.geometry.aabbs.stride = sizeof(VkAabbPositionsKHR);
        build.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
        build.info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        build.primitives = 1;
        size_t updateScratch = 0;
        structure = make(build, build.info.type, "unit shapes", updateScratch);
        queued_.push_back({shared::kNone, build});
        return structure.address();
    }

    /// Builds what is queued, in batches that share scratch memory, then the top level over it.
    void submit(const Build& top) {
        std::vector<Build> builds;
        for (const Queued& q : queued_) builds.push_back(q.build);
        size_t sum = 0, largest = top.scratchBytes;
        for (const Build& build : builds) {
            sum += build.scratchBytes + scratchAlignment_;
            largest = std::max(largest, build.scratchBytes);
        }
        const size_t bytes = std::max(std::min(sum, kScratchBytes), largest) + scratchAlignment_;
        const gpu::Buffer scratch = device_.createBuffer(bytes, gpu::Memory::Device, "scratch of structure builds");

        device_.submit([&](gpu::Commands& commands) {
            commands.barrier();
            const VkDeviceAddress base = aligned(scratch.address());
            const VkDeviceAddress end = scratch.address() + scratch.size();
            VkDeviceAddress at = base;
            for (Build& build : builds) {
                if (at + build.scratchBytes > end) {
                    commands.barrier();
                    at = base;
                }
                record(commands, build, at);
                at = aligned(at + build.scratchBytes);
            }
            commands.barrier();
            Build last = top;
            record(commands, last, base);
            commands.barrier();
        });
        queued_.clear(); // a submission that failed is tried again
    }

    VkDeviceAddress aligned(VkDeviceAddress address) const {
        return (address + scratchAlignment_ - 1) / scratchAlignment_ * scratchAlignment_;
    }

    void record(gpu::Commands& commands, Build& build, VkDeviceAddress scratch) const {
        build.info.geometryCount = 1;
        build.info.pGeometries = &build.geometry; // the build may have been copied since
        build.info.scratchData.deviceAddress = scratch;
        const VkAccelerationStructureBuildRangeInfoKHR range{build.primitives, 0, 0, 0};
        const VkAccelerationStructureBuildRangeInfoKHR* ranges = &range;
        functions_.build(commands.handle(), 1, &build.info, &ranges);
    }

    gpu::Device& device_;
    Functions functions_;
    size_t scratchAlignment_ = 1;
    std::vector<Mesh> meshes_;
    std::vector<Queued> queued_;
    std::array<Structure, kShapes> shapes_;
    gpu::Buffer shapeBoxes_, instances_;
    Structure top_, previousTop_;
    std::vector<Structure> retired_; ///< bottom levels that previousTop_ may name
};

} // namespace

std::unique_ptr<AccelBackend> createQueryBackend(gpu::Device& device) { return std::make_unique<QueryBackend>(device); }

} // namespace trilume::rt
