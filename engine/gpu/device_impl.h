#pragma once

#include "gpu/adapter.h"
#include "gpu/bindless_table.h"
#include "gpu/frame_ring.h"
#include "gpu/memory.h"
#include "gpu/pipeline_library.h"
#include "gpu/upload_queue.h"

#include <array>
#include <deque>
#include <mutex>

namespace trilume::gpu {

/// Owns the VkDevice, so that members declared after it can let go of their handles first.
struct LogicalDevice {
    explicit LogicalDevice(const Adapter& adapter) : handle(createLogicalDevice(adapter)) {
        vkGetDeviceQueue(handle, adapter.queueFamily, 0, &queue);
    }
    ~LogicalDevice() { vkDestroyDevice(handle, nullptr); }
    LogicalDevice(const LogicalDevice&) = delete;
    LogicalDevice& operator=(const LogicalDevice&) = delete;

    VkDevice handle = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
};

/// Larger uploads and read-backs go in pieces.
constexpr size_t kStagingBytes = 64ull << 20;

struct Device::Impl {
    explicit Impl(const DeviceOptions& options);
    ~Impl();

    /// Calls `destroy` once the device is done with everything recorded so far.
    void retire(std::function<void()> destroy);
    /// Runs what is due.
    void collectGarbage();
    /// Runs what was retired up to the timeline value `completed`.
    void destroyGarbage(uint64_t completed);
    /// Memory for `requirements`, waiting for retired memory when there is no other; throws runError naming `what`.
    Allocation allocate(Device& device, const VkMemoryRequirements& requirements, Memory memory,
                        MemoryAllocator::Kind kind, std::string_view what, uint64_t bytes);
    Submission submit(Device& device, const std::function<void(Commands&)>& record);
    /// Makes sure that queued uploads are on their way.
    void flush(Device& device);
    /// The same once there are many, so that staging memory stays bounded.
    void limitStaging(Device& device);

    Instance instance;
    Adapter adapter;
    LogicalDevice device;
    MemoryAllocator memory;
    BindlessTable bindless;
    PipelineLibrary pipelines;
    FrameRing frames;

    struct Garbage {
        uint64_t value;
        std::function<void()> destroy;
    };
    std::deque<Garbage> garbage;
    std::mutex firstDispatches;         ///< held by the thread that submits one
    std::optional<UploadQueue> uploads; ///< made by the Device, whose buffers it uses
    uint64_t uploadedBytes = 0;
    bool recording = false;
    std::array<VkAccelerationStructureKHR, 2> topLevels{}; ///< this frame's and last frame's, by binding
};

struct Buffer::Impl {
    Device::Impl& device;
    VkBuffer handle = VK_NULL_HANDLE;
    Allocation memory;

    explicit Impl(Device::Impl& owner) : device(owner) {}
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
};

struct Image::Impl {
    Device::Impl& device;
    VkImage handle = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    Allocation memory;
    uint32_t index = BindlessTable::kNone;

    explicit Impl(Device::Impl& owner) : device(owner) {}
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
};

struct Pipeline::Impl {
    Device::Impl& device;
    Program program;
    uint32_t localSize[3] = {1, 1, 1};
    bool usesTopLevel = false;
    PipelineCost cost;

    explicit Impl(Device::Impl& owner) : device(owner) {}
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
};

} // namespace trilume::gpu
