#pragma once

#include "gpu/adapter.h"

#include <array>

namespace trilume::gpu {

/// What one submission records into; used again when the submission has completed.
struct Frame {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer uploads = VK_NULL_HANDLE, commands = VK_NULL_HANDLE;
    VkQueryPool timestamps = VK_NULL_HANDLE;
    VkDescriptorSet topLevelSet = VK_NULL_HANDLE; ///< null without ray queries
    bool topLevelWritten = false;
    std::vector<bool> written; ///< which timestamp slots
    uint64_t value = 0;        ///< of the timeline, when this frame's work is done
};

/// The frames in flight, and the timeline semaphore that counts submissions.
class FrameRing {
public:
    static constexpr uint32_t kFrames = 3;
    static constexpr uint32_t kTimestampSlots = 512;

    /// `topLevelLayout`: of the set that binds the TLAS; null without ray queries.
    FrameRing(const Adapter& adapter, VkDevice device, VkQueue queue, VkDescriptorSetLayout topLevelLayout);
    ~FrameRing();
    FrameRing(const FrameRing&) = delete;
    FrameRing& operator=(const FrameRing&) = delete;

    /// Waits until the next frame is free and returns it, reset, with both command buffers begun.
    Frame& begin();
    /// Ends and submits both command buffers, uploads first. Returns the timeline value.
    uint64_t submit(Frame& frame);

    uint64_t submitted() const { return submitted_; }
    uint64_t completed() const;
    void wait(uint64_t value) const;
    /// The frame of submission `value`; throws inputError when it was used again since.
    const Frame& find(uint64_t value) const;
    std::vector<double> timestamps(uint64_t value) const;

private:
    const Adapter& adapter_;
    VkDevice device_;
    VkQueue queue_;
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
    std::array<Frame, kFrames> frames_;
    uint64_t submitted_ = 0;
};

} // namespace trilume::gpu
