#include "gpu/device_impl.h"

#include "core/error.h"
#include "core/log.h"
#include "gpu/barrier.h"
#include "gpu/result.h"

#include <fmt/core.h>

#include <cstdlib>
#include <string_view>

namespace trilume::gpu {
namespace {

bool validationInEnvironment() {
    const char* value = std::getenv("TRILUME_VALIDATION");
    return value && *value != 0 && std::string_view(value) != "0";
}

Adapter chooseAdapter(VkInstance instance, const std::string& choice, bool validation) {
    std::vector<Adapter> adapters = listAdapters(instance);
    std::vector<DeviceInfo> infos;
    infos.reserve(adapters.size());
    for (const Adapter& adapter : adapters) infos.push_back(adapter.info);
    Adapter& chosen = adapters[chooseDevice(infos, choice)];
    chosen.keepsShaders &= !validation; // layers older than the extension don't know its handles
    return std::move(chosen);
}

} // namespace

// ---- Impl ------------------------------------------------------------------------------------------

Device::Impl::Impl(const DeviceOptions& options)
    : instance(options.validation || validationInEnvironment()),
      adapter(chooseAdapter(instance.handle(), options.device, instance.validates())), device(adapter),
      memory(adapter, device.handle, options.memoryLimit), bindless(adapter, device.handle),
      pipelines(adapter, device.handle, bindless.layout()),
      frames(adapter, device.handle, device.queue, pipelines.topLevelSetLayout()) {}

Device::Impl::~Impl() {
    // A lost device has nothing left to wait for, and its handles may still be destroyed.
    const VkResult idle = vkDeviceWaitIdle(device.handle);
    if (idle != VK_SUCCESS) log::debug("device left in state {}", static_cast<int>(idle));
    destroyGarbage(frames.submitted() + 1); // staging pages go back to the queue,
    uploads->clear();                       // which gives them up
    destroyGarbage(frames.submitted() + 1);
}

void Device::Impl::retire(std::function<void()> destroy) {
    const bool pending = recording || !uploads->empty();
    garbage.push_back({frames.submitted() + pending, std::move(destroy)});
}

void Device::Impl::collectGarbage() { destroyGarbage(frames.completed()); }

void Device::Impl::destroyGarbage(uint64_t completed) {
    while (!garbage.empty() && garbage.front().value <= completed) {
        const auto destroy = std::move(garbage.front().destroy);
        garbage.pop_front();
        destroy();
    }
}

Allocation Device::Impl::allocate(Device& owner, const VkMemoryRequirements& requirements, Memory kindOfMemory,
                                  MemoryAllocator::Kind kind, std::string_view what, uint64_t bytes) {
    collectGarbage();
    auto allocation = memory.allocate(requirements, kindOfMemory, kind);
    if (!allocation && !garbage.empty() && !recording) {
        flush(owner); // what is retired while uploads are queued waits for them
        frames.wait(frames.submitted());
        collectGarbage();
        allocation = memory.allocate(requirements, kindOfMemory, kind);
    }
    if (allocation) return *allocation;
    constexpr double kMiB = 1 << 20;
    throw runError(fmt::format("out of memory: {} asked for {:.1f} MiB", what, static_cast<double>(bytes) / kMiB),
                   adapter.info.name,
                   fmt::format("{:.0f} of {:.0f} MiB are in use and one allocation holds at most {:.0f} MiB: render a "
                               "smaller image or a simpler scene",
                               static_cast<double>(memory.inUse()) / kMiB,
                               static_cast<double>(memory.capacity()) / kMiB,
                               static_cast<double>(adapter.maxAllocation) / kMiB));
}

Submission Device::Impl::submit(Device& owner, const std::function<void(Commands&)>& record) {
    if (recording) throw runError("submit inside a submission", adapter.info.name, "record into the Commands given");
    collectGarbage();
    Frame& frame = frames.begin();
    std::vector<Buffer> pages;
    {
        struct Recording {
            bool& flag;
            explicit Recording(bool& f) : flag(f) { flag = true; }
            ~Recording() { flag = false; }
        } guard(recording);
        Commands commands;
        commands.handle_ = frame.commands;
        commands.device_ = &owner;
        commands.frame_ = &frame;
        record(commands);
        recordBarrier(frame.commands); // later submissions, and the host, see what this one wrote
        pages = uploads->record(frame.uploads);
        frames.submit(frame);
    }
    if (!pages.empty())
        retire([this, shared = std::make_shared<std::vector<Buffer>>(std::move(pages))] {
            uploads->recycle(std::move(*shared));
        });
    return {frames.submitted()};
}

void Device::Impl::flush(Device& owner) {
    if (!uploads->empty()) submit(owner, [](Commands&) {});
}

void Device::Impl::limitStaging(Device& owner) {
    if (uploads->stagedBytes() >= kStagingBytes && !recording) flush(owner);
}

// ---- Device ----------------------------------------------------------------------------------------

Device::Device(const DeviceOptions& options) : impl_(std::make_unique<Impl>(options)) {
    impl_->uploads.emplace([this](size_t bytes) { return createBuffer(bytes, Memory::Upload, "staging of uploads"); });
    log::info("device: {} ({})", info().name, info().driver);
}
Device::~Device() = default;

const DeviceInfo& Device::info() const { return impl_->adapter.info; }
VkDevice Device::handle() const { return impl_->device.handle; }
VkPhysicalDevice Device::physicalDevice() const { return impl_->adapter.handle; }
VkInstance Device::instance() const { return impl_->instance.handle(); }

Submission Device::submit(const std::function<void(Commands&)>& record) { return impl_->submit(*this, record); }
void Device::wait(Submission submission) { impl_->frames.wait(submission.value); }
void Device::waitIdle() { impl_->frames.wait(impl_->frames.submitted()); }
std::vector<double> Device::timestamps(Submission submission) const {
    return impl_->frames.timestamps(submission.value);
}

void Device::setTopLevel(VkAccelerationStructureKHR topLevel, VkAccelerationStructureKHR previous) {
    impl_->topLevels = {topLevel, previous};
}
void Device::destroyLater(std::function<void()> destroy) { impl_->retire(std::move(destroy)); }
size_t Device::memoryInUse() const { return impl_->memory.inUse(); }
uint64_t Device::uploadedBytes() const { return impl_->uploadedBytes; }
uint32_t Device::validationMessages() const { return impl_->instance.messages(); }
void Device::savePipelineCache() { impl_->pipelines.save(); }

} // namespace trilume::gpu
