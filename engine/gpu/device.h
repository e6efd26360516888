#pragma once

#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace trilume::gpu {

enum class Tracer { Auto, Compute, Query };

struct DeviceInfo {
    uint32_t index = 0;             ///< in the order of vkEnumeratePhysicalDevices
    std::string name, driver, type; ///< type: discrete, integrated, virtual, cpu, other
    bool rayQuery = false;
    std::string missing; ///< the first required feature that is absent; empty: usable
};

struct DeviceOptions {
    std::string device = "auto"; ///< auto (discrete, integrated, virtual, cpu), an index, or part of a name
    bool validation = false;     ///< validation with synchronisation validation; messages are counted and logged.
                                 ///< TRILUME_VALIDATION=1 in the environment turns it on as well
    size_t memoryLimit = 0;      ///< bytes of device memory to take at most; 0: what the device has
};

/// What the instance sees. Never throws for a machine without a driver: the list is empty.
std::vector<DeviceInfo> listDevices();

enum class Memory { Device, Upload, Readback };

/// A buffer with a device address (always: storage, transfer, and what the extra usage says).
/// Movable; frees itself, after the device has finished with it (deferred by submission).
class Buffer {
public:
    Buffer();
    Buffer(Buffer&&) noexcept;
    Buffer& operator=(Buffer&&) noexcept;
    ~Buffer();

    explicit operator bool() const { return size_ != 0; }
    VkBuffer handle() const;
    VkDeviceAddress address() const { return address_; }
    size_t size() const { return size_; }
    /// Host pointer; null for Memory::Device that the host can't see.
    std::byte* mapped() const { return mapped_; }

private:
    friend class Device;
    struct Impl;
    std::unique_ptr<Impl> impl_;
    VkDeviceAddress address_ = 0;
    size_t size_ = 0;
    std::byte* mapped_ = nullptr;
};

/// A sampled 2D image in the bindless table.
class Image {
public:
    Image();
    Image(Image&&) noexcept;
    Image& operator=(Image&&) noexcept;
    ~Image();

    explicit operator bool() const { return impl_ != nullptr; }
    /// Index into the bindless sampler array (set 0, binding 0).
    uint32_t bindlessIndex() const;

private:
    friend class Device;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

struct SamplerMode {
    VkSamplerAddressMode u = VK_SAMPLER_ADDRESS_MODE_REPEAT, v = VK_SAMPLER_ADDRESS_MODE_REPEAT;
};

/// Milliseconds that a pipeline took before its first use.
struct PipelineCost {
    std::string name;      ///< the shader's path
    double spirvMs = 0;    ///< GLSL to SPIR-V, or finding it in the cache
    double driverMs = 0;   ///< the driver's front end, or finding its result in a cache
    double dispatchMs = 0; ///< a first dispatch of nothing, with which software drivers generate code; 0 unless made by
                           ///< createPipelines
};

/// A compute pipeline: one push-constant block, set 0 the bindless table (and, with ray queries, set 1 the TLAS).
class Pipeline {
public:
    Pipeline();
    Pipeline(Pipeline&&) noexcept;
    Pipeline& operator=(Pipeline&&) noexcept;
    ~Pipeline();
    explicit operator bool() const { return impl_ != nullptr; }
    const PipelineCost& cost() const;

private:
    friend class Device;
    friend class Commands;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// What to compile: an entry file below the shader root, with macro definitions.
struct ShaderSource {
    std::string path; ///< e.g. "passes/pathtrace/pathtrace.comp"
    std::vector<std::pair<std::string, std::string>> defines;
    std::vector<uint32_t> specialization; ///< constant_id i has value specialization[i]
    std::string text;                     ///< GLSL in place of the file's; `path` then only names it in messages
};

class Device;

/// Records into one command buffer. One made by default has none and drops what it is given, pipelines unseen.
class Commands {
public:
    VkCommandBuffer handle() const { return handle_; }
    Device& device() const { return *device_; }

    /// Binds, pushes `push` and dispatches ceil(threads / local size of the shader) groups.
    void dispatch(const Pipeline& pipeline, std::span<const std::byte> push, uint32_t threadsX, uint32_t threadsY = 1,
                  uint32_t threadsZ = 1);
    template<class Push>
    requires std::is_trivially_copyable_v<Push>
    void dispatch(const Pipeline& pipeline, const Push& push, uint32_t threadsX, uint32_t threadsY = 1,
                  uint32_t threadsZ = 1) {
        dispatch(pipeline, std::as_bytes(std::span(&push, 1)), threadsX, threadsY, threadsZ);
    }
    /// Makes earlier compute and transfer writes visible to later compute, transfer and acceleration-structure work.
    void barrier();
    void copy(const Buffer& from, size_t fromOffset, const Buffer& to, size_t toOffset, size_t bytes);
    /// Word-wise fill; offset and bytes are multiples of 4.
    void fill(const Buffer& buffer, size_t offset, size_t bytes, uint32_t word);
    /// Writes a timestamp into slot `slot` of this submission; read by Submission::timestamps.
    void timestamp(uint32_t slot);

private:
    friend class Device;
    void bind(const Pipeline::Impl& pipeline);

    VkCommandBuffer handle_ = VK_NULL_HANDLE;
    Device* device_ = nullptr;
    void* frame_ = nullptr;
};

/// A submission under way.
struct Submission {
    uint64_t value = 0; ///< of the device's timeline semaphore
};

/// One logical device with one compute-capable queue, its memory, caches and bindless table.
/// Errors: inputError for a device that does not exist, has no driver or misses a feature (named);
/// runError for out of memory (names what asked for how much) and a lost device.
class Device {
public:
    explicit Device(const DeviceOptions& options);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const DeviceInfo& info() const;
    bool rayQuery() const { return info().rayQuery; }
    bool isCpu() const { return info().type == "cpu"; }
    VkDevice handle() const;
    VkPhysicalDevice physicalDevice() const;
    VkInstance instance() const;

    /// `what` names the asker in out-of-memory errors. A size of 0 gives a buffer of 16 bytes.
    Buffer createBuffer(size_t bytes, Memory memory, std::string_view what, VkBufferUsageFlags extra = 0);
    /// Copies now-available bytes to the buffer: by memcpy where the host can write it and the device is idle on it,
    /// else by a staging copy recorded into the next submission, ahead of everything else.
    void upload(Buffer& buffer, size_t offset, std::span<const std::byte> bytes);
    template<class T>
    Buffer createBufferFrom(std::span<const T> data, std::string_view what, VkBufferUsageFlags extra = 0) {
        Buffer b = createBuffer(data.size_bytes(), Memory::Device, what, extra);
        if (!data.empty()) upload(b, 0, std::as_bytes(data));
        return b;
    }
    /// Waits for the device, then copies. For tests, read-back and tools.
    void download(const Buffer& buffer, size_t offset, std::span<std::byte> bytes);

    /// Creates a sampled image with a full mip chain (box-filtered on the CPU), uploads it and enters it into the
    /// bindless table. Formats: VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R32G32B32A32_SFLOAT.
    Image createImage(uint32_t width, uint32_t height, VkFormat format, std::span<const std::byte> pixels,
                      SamplerMode sampler, std::string_view what);

    /// Compiles GLSL (SPIR-V cached on disk) and creates the pipeline through the pipeline cache.
    /// Throws runError with the compiler's first message, naming file and line.
    Pipeline createPipeline(const ShaderSource& source);
    /// The same for several, on all threads of the task pool, and ready to run: where the driver generates code with
    /// the first dispatch, it does so now, beside the compilation of the next.
    std::vector<Pipeline> createPipelines(std::span<const ShaderSource> sources);

    /// Records and submits; returns at once. Uploads queued before are executed first.
    Submission submit(const std::function<void(Commands&)>& record);
    void wait(Submission submission);
    void waitIdle();
    /// Milliseconds at each slot up to the last one written by the submission, relative to slot 0; a slot not written
    /// repeats the one before. Valid after wait and until two more submissions were made.
    std::vector<double> timestamps(Submission submission) const;

    /// The TLAS that ray-query pipelines see (set 1, binding 0) and that of last frame (binding 1), from the next
    /// submission's first such dispatch on.
    void setTopLevel(VkAccelerationStructureKHR topLevel, VkAccelerationStructureKHR previous);

    /// Calls `destroy` once every submission that was made, or is being recorded, has completed.
    void destroyLater(std::function<void()> destroy);

    size_t memoryInUse() const;          ///< bytes of live buffers and images
    uint64_t uploadedBytes() const;      ///< given to upload and createImage so far
    uint32_t validationMessages() const; ///< warnings and errors so far; 0 without validation
    void savePipelineCache();            ///< also done by the destructor

    struct Impl;
    Impl& impl() { return *impl_; }

private:
    void dispatchNothing(const Pipeline& pipeline);

    std::unique_ptr<Impl> impl_;
};

} // namespace trilume::gpu
