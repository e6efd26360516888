#include "gpu/device_impl.h"

#include "core/error.h"
#include "gpu/mip_chain.h"
#include "gpu/result.h"

#include <fmt/core.h>

namespace trilume::gpu {

Image::Image() = default;
Image::Image(Image&&) noexcept = default;
Image& Image::operator=(Image&&) noexcept = default;
Image::~Image() = default;
uint32_t Image::bindlessIndex() const { return impl_->index; }

Image::Impl::~Impl() {
    if (!handle) return;
    device.retire([owner = &device, handle = handle, view = view, memory = memory, index = index] {
        if (index != BindlessTable::kNone) owner->bindless.remove(index);
        vkDestroyImageView(owner->device.handle, view, nullptr);
        vkDestroyImage(owner->device.handle, handle, nullptr);
        if (memory.block) owner->memory.release(memory);
    });
}

Image Device::createImage(uint32_t width, uint32_t height, VkFormat format, std::span<const std::byte> pixels,
                          SamplerMode sampler, std::string_view what) {
    const uint32_t limit = impl_->adapter.properties.limits.maxImageDimension2D;
    if (width == 0 || height == 0 || width > limit || height > limit)
        throw inputError(fmt::format("an image of {} x {} pixels", width, height), std::string(what),
                         fmt::format("the device takes 1 to {} each way", limit));
    if (texelBytes(format) == 0 || pixels.size() != size_t{width} * height * texelBytes(format))
        throw runError(fmt::format("{} bytes for an image of {} x {}, format {}", pixels.size(), width, height,
                                   static_cast<int>(format)),
                       std::string(what), "this is a fault in the program");
    const MipChain chain = buildMipChain(width, height, format, pixels);
    const auto levels = static_cast<uint32_t>(chain.levels.size());

    VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {width, height, 1};
    info.mipLevels = levels;
    info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    Image image;
    image.impl_ = std::make_unique<Image::Impl>(*impl_);
    Image::Impl& parts = *image.impl_;
    check(vkCreateImage(handle(), &info, nullptr, &parts.handle), "vkCreateImage");
    VkMemoryRequirements requirements{};
    vkGetImageMemoryRequirements(handle(), parts.handle, &requirements);
    parts.memory =
        impl_->allocate(*this, requirements, Memory::Device, MemoryAllocator::Kind::Image, what, requirements.size);
    check(vkBindImageMemory(handle(), parts.handle, parts.memory.memory, parts.memory.offset), "vkBindImageMemory");

    VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view.image = parts.handle;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, levels, 0, 1};
    check(vkCreateImageView(handle(), &view, nullptr, &parts.view), "vkCreateImageView");

    VkFormatProperties properties{};
    vkGetPhysicalDeviceFormatProperties(physicalDevice(), format, &properties);
    const bool filters = properties.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
    parts.index = impl_->bindless.add(parts.view, sampler, filters ? VK_FILTER_LINEAR : VK_FILTER_NEAREST);

    std::vector<VkBufferImageCopy> regions(levels);
    for (uint32_t i = 0; i < levels; ++i) {
        regions[i].bufferOffset = chain.levels[i].offset;
        regions[i].imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, i, 0, 1};
        regions[i].imageExtent = {chain.levels[i].width, chain.levels[i].height, 1};
    }
    impl_->uploadedBytes += chain.texels.size();
    impl_->uploads->toImage(parts.handle, std::move(regions), chain.texels);
    impl_->limitStaging(*this);
    return image;
}

} // namespace trilume::gpu
