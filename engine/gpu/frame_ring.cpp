#include "gpu/frame_ring.h"

#include "core/error.h"
#include "gpu/result.h"

#include <fmt/core.h>

namespace trilume::gpu {
namespace {

VkCommandBuffer allocateCommandBuffer(VkDevice device, VkCommandPool pool) {
    VkCommandBufferAllocateInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    info.commandPool = pool;
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    VkCommandBuffer buffer = VK_NULL_HANDLE;
    check(vkAllocateCommandBuffers(device, &info, &buffer), "vkAllocateCommandBuffers");
    return buffer;
}

void beginCommandBuffer(VkCommandBuffer buffer) {
    VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vkBeginCommandBuffer(buffer, &info), "vkBeginCommandBuffer");
}

} // namespace

FrameRing::FrameRing(const Adapter& adapter, VkDevice device, VkQueue queue, VkDescriptorSetLayout topLevelLayout)
    : adapter_(adapter), device_(device), queue_(queue) {
    VkSemaphoreTypeCreateInfo type{VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO};
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    const VkSemaphoreCreateInfo semaphore{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type, 0};
    check(vkCreateSemaphore(device, &semaphore, nullptr, &timeline_), "vkCreateSemaphore");

    if (topLevelLayout) {
        const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 2 * kFrames};
        VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool.maxSets = kFrames;
        pool.poolSizeCount = 1;
        pool.pPoolSizes = &size;
        check(vkCreateDescriptorPool(device, &pool, nullptr, &descriptors_), "vkCreateDescriptorPool");
    }
    for (Frame& frame : frames_) {
        VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
        pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
        pool.queueFamilyIndex = adapter.queueFamily;
        check(vkCreateCommandPool(device, &pool, nullptr, &frame.pool), "vkCreateCommandPool");
        frame.uploads = allocateCommandBuffer(device, frame.pool);
        frame.commands = allocateCommandBuffer(device, frame.pool);

        VkQueryPoolCreateInfo queries{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
        queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
        queries.queryCount = kTimestampSlots;
        check(vkCreateQueryPool(device, &queries, nullptr, &frame.timestamps), "vkCreateQueryPool");

        if (topLevelLayout) {
            VkDescriptorSetAllocateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
            set.descriptorPool = descriptors_;
            set.descriptorSetCount = 1;
            set.pSetLayouts = &topLevelLayout;
            check(vkAllocateDescriptorSets(device, &set, &frame.topLevelSet), "vkAllocateDescriptorSets");
        }
    }
}

FrameRing::~FrameRing() {
    for (const Frame& frame : frames_) {
        vkDestroyQueryPool(device_, frame.timestamps, nullptr);
        vkDestroyCommandPool(device_, frame.pool, nullptr);
    }
    vkDestroyDescriptorPool(device_, descriptors_, nullptr);
    vkDestroySemaphore(device_, timeline_, nullptr);
}

Frame& FrameRing::begin() {
    Frame& frame = frames_[(submitted_ + 1) % kFrames];
    wait(frame.value);
    check(vkResetCommandPool(device_, frame.pool, 0), "vkResetCommandPool");
    vkResetQueryPool(device_, frame.timestamps, 0, kTimestampSlots);
    frame.written.assign(kTimestampSlots, false);
    frame.topLevelWritten = false;
    beginCommandBuffer(frame.uploads);
    beginCommandBuffer(frame.commands);
    return frame;
}

uint64_t FrameRing::submit(Frame& frame) {
    check(vkEndCommandBuffer(frame.uploads), "vkEndCommandBuffer");
    check(vkEndCommandBuffer(frame.commands), "vkEndCommandBuffer");
    VkCommandBufferSubmitInfo buffers[2] = {{VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO},
                                            {VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO}};
    buffers[0].commandBuffer = frame.uploads;
    buffers[1].commandBuffer = frame.commands;
    VkSemaphoreSubmitInfo signal{VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO};
    signal.semaphore = timeline_;
    signal.value = submitted_ + 1;
    signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    VkSubmitInfo2 info{VK_STRUCTURE_TYPE_SUBMIT_INFO_2};
    info.commandBufferInfoCount = 2;
    info.pCommandBufferInfos = buffers;
    info.signalSemaphoreInfoCount = 1;
    info.pSignalSemaphoreInfos = &signal;
    check(vkQueueSubmit2(queue_, 1, &info, VK_NULL_HANDLE), "vkQueueSubmit2");
    frame.value = ++submitted_;
    return submitted_;
}

uint64_t FrameRing::completed() const {
    uint64_t value = 0;
    check(vkGetSemaphoreCounterValue(device_, timeline_, &value), "vkGetSemaphoreCounterValue");
    return value;
}

void FrameRing::wait(uint64_t value) const {
    VkSemaphoreWaitInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
    info.semaphoreCount = 1;
    info.pSemaphores = &timeline_;
    info.pValues = &value;
    check(vkWaitSemaphores(device_, &info, UINT64_MAX), "vkWaitSemaphores");
}

const Frame& FrameRing::find(uint64_t value) const {
    const Frame& frame = frames_[value % kFrames];
    if (value == 0 || frame.value != value)
        throw inputError("the submission's timestamps are gone", fmt::format("submission {}", value),
                         "read them before two more submissions are made");
    return frame;
}

std::vector<double> FrameRing::timestamps(uint64_t value) const {
    const Frame& frame = find(value);
    uint32_t count = kTimestampSlots;
    while (count > 0 && !frame.written[count - 1]) --count;
    if (count == 0) return {};

    struct Stamp {
        uint64_t ticks, available;
    };
    std::vector<Stamp> stamps(count);
    const VkResult result =
        vkGetQueryPoolResults(device_, frame.timestamps, 0, count, count * sizeof(Stamp), stamps.data(), sizeof(Stamp),
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WITH_AVAILABILITY_BIT);
    if (result != VK_NOT_READY) check(result, "vkGetQueryPoolResults");

    const double msPerTick = adapter_.properties.limits.timestampPeriod * 1e-6;
    std::vector<double> ms(count);
    for (uint32_t i = 0; i < count; ++i) {
        const bool known = stamps[i].available && stamps[0].available && stamps[i].ticks >= stamps[0].ticks;
        ms[i] = known ? static_cast<double>(stamps[i].ticks - stamps[0].ticks) * msPerTick : i ? ms[i - 1] : 0;
    }
    return ms;
}

} // namespace trilume::gpu
