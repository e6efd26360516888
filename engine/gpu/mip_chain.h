#pragma once

#include <vulkan/vulkan.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trilume::gpu {

struct MipLevel {
    uint32_t width = 0, height = 0;
    size_t offset = 0; ///< bytes into MipChain::texels
};

struct MipChain {
    std::vector<std::byte> texels;
    std::vector<MipLevel> levels; ///< down to 1 x 1
};

/// Bytes of a texel of one of the three formats that Device::createImage takes; 0 for any other.
size_t texelBytes(VkFormat format);

/// Filters `pixels` (width x height texels of `format`, rows without padding) down by an area-weighted box, so that
/// every level keeps the image's mean, also for odd sizes. sRGB colours are averaged as linear light.
MipChain buildMipChain(uint32_t width, uint32_t height, VkFormat format, std::span<const std::byte> pixels);

} // namespace trilume::gpu
