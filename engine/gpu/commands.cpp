#include "gpu/device_impl.h"

#include "core/error.h"
#include "gpu/barrier.h"

#include <fmt/core.h>

namespace trilume::gpu {
namespace {

Frame& frameOf(void* frame) { return *static_cast<Frame*>(frame); }

/// The frame's own set, so that it is written while nothing uses it.
void bindTopLevel(Device::Impl& device, Frame& frame, const std::string& pipeline) {
    if (!frame.topLevelWritten) {
        if (!device.topLevels[0])
            throw runError("no top-level acceleration structure", pipeline, "this is a fault in the program");
        for (uint32_t binding = 0; binding < device.topLevels.size(); ++binding) {
            VkWriteDescriptorSetAccelerationStructureKHR structure{
                VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR};
            structure.accelerationStructureCount = 1;
            structure.pAccelerationStructures = &device.topLevels[binding];
            VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, &structure};
            write.dstSet = frame.topLevelSet;
            write.dstBinding = binding;
            write.descriptorCount = 1;
            write.descriptorType = VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR;
            vkUpdateDescriptorSets(device.device.handle, 1, &write, 0, nullptr);
        }
        frame.topLevelWritten = true;
    }
    vkCmdBindDescriptorSets(frame.commands, VK_PIPELINE_BIND_POINT_COMPUTE, device.pipelines.layout(true), 1, 1,
                            &frame.topLevelSet, 0, nullptr);
}

} // namespace

void Commands::dispatch(const Pipeline& pipeline, std::span<const std::byte> push, uint32_t threadsX, uint32_t threadsY,
                        uint32_t threadsZ) {
    if (!handle_ || threadsX == 0 || threadsY == 0 || threadsZ == 0) return;
    Device::Impl& device = device_->impl();
    const Pipeline::Impl& compute = *pipeline.impl_;
    const uint32_t threads[3] = {threadsX, threadsY, threadsZ};
    const auto& limits = device.adapter.properties.limits;
    uint32_t groups[3];
    for (int i = 0; i < 3; ++i) {
        groups[i] = (threads[i] - 1) / compute.localSize[i] + 1;
        if (groups[i] > limits.maxComputeWorkGroupCount[i])
            throw runError(fmt::format("a dispatch of {} groups is more than the device's {}", groups[i],
                                       limits.maxComputeWorkGroupCount[i]),
                           compute.cost.name, "render a smaller image, or spread the threads over two dimensions");
    }
    if (push.size() > device.pipelines.pushBytes() || push.size() % 4 != 0)
        throw runError(fmt::format("{} bytes of push constants, the device takes multiples of 4 up to {}", push.size(),
                                   device.pipelines.pushBytes()),
                       compute.cost.name, "this is a fault in the program");

    bind(compute);
    if (!push.empty())
        vkCmdPushConstants(handle_, device.pipelines.layout(compute.usesTopLevel), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                           static_cast<uint32_t>(push.size()), push.data());
    vkCmdDispatch(handle_, groups[0], groups[1], groups[2]);
}

void Commands::bind(const Pipeline::Impl& compute) {
    Device::Impl& device = device_->impl();
    const VkDescriptorSet bindless = device.bindless.set();
    device.pipelines.bind(handle_, compute.program);
    vkCmdBindDescriptorSets(handle_, VK_PIPELINE_BIND_POINT_COMPUTE, device.pipelines.layout(compute.usesTopLevel), 0,
                            1, &bindless, 0, nullptr);
    if (compute.usesTopLevel) bindTopLevel(device, frameOf(frame_), compute.cost.name);
}

void Commands::barrier() {
    if (handle_) recordBarrier(handle_);
}

void Commands::copy(const Buffer& from, size_t fromOffset, const Buffer& to, size_t toOffset, size_t bytes) {
    if (!handle_ || bytes == 0) return;
    const VkBufferCopy region{fromOffset, toOffset, bytes};
    vkCmdCopyBuffer(handle_, from.handle(), to.handle(), 1, &region);
}

void Commands::fill(const Buffer& buffer, size_t offset, size_t bytes, uint32_t word) {
    if (handle_ && bytes != 0) vkCmdFillBuffer(handle_, buffer.handle(), offset, bytes, word);
}

void Commands::timestamp(uint32_t slot) {
    if (!handle_) return;
    Frame& frame = frameOf(frame_);
    if (slot >= FrameRing::kTimestampSlots)
        throw runError(fmt::format("timestamp slot {} of {}", slot, FrameRing::kTimestampSlots), "submission",
                       "this is a fault in the program");
    vkCmdWriteTimestamp2(handle_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, frame.timestamps, slot);
    frame.written[slot] = true;
}

} // namespace trilume::gpu
