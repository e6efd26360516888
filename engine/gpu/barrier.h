#pragma once

#include <vulkan/vulkan.h>

namespace trilume::gpu {

/// Everything written before is visible to everything after, on the device and to the host once it has waited.
/// One global barrier: work between barriers is what overlaps, and finer ones gain nothing on one queue.
void recordBarrier(VkCommandBuffer commands);

/// Moves all mip levels of a colour image to another layout, between transfers and shader reads.
void recordLayout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to);

} // namespace trilume::gpu
