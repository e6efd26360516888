#include "gpu/bindless_table.h"

#include "core/error.h"
#include "gpu/result.h"

#include <fmt/core.h>

#include <algorithm>

namespace trilume::gpu {
namespace {

constexpr uint32_t kMaximumTextures = 4096;

uint32_t tableSize(VkPhysicalDevice device) {
    VkPhysicalDeviceVulkan12Properties limits{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES};
    VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &limits};
    vkGetPhysicalDeviceProperties2(device, &properties);
    return std::min({kMaximumTextures, limits.maxPerStageDescriptorUpdateAfterBindSampledImages,
                     limits.maxPerStageDescriptorUpdateAfterBindSamplers,
                     limits.maxDescriptorSetUpdateAfterBindSampledImages,
                     limits.maxDescriptorSetUpdateAfterBindSamplers, limits.maxPerStageUpdateAfterBindResources});
}

} // namespace

BindlessTable::BindlessTable(const Adapter& adapter, VkDevice device)
    : device_(device), capacity_(tableSize(adapter.handle)) {
    const VkDescriptorSetLayoutBinding binding{0, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, capacity_,
                                               VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    const VkDescriptorBindingFlags bindingFlags =
        VK_DESCRIPTOR_BINDING_PARTIALLY_BOUND_BIT | VK_DESCRIPTOR_BINDING_UPDATE_AFTER_BIND_BIT;
    VkDescriptorSetLayoutBindingFlagsCreateInfo flags{
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_BINDING_FLAGS_CREATE_INFO};
    flags.bindingCount = 1;
    flags.pBindingFlags = &bindingFlags;
    VkDescriptorSetLayoutCreateInfo layout{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, &flags};
    layout.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_UPDATE_AFTER_BIND_POOL_BIT;
    layout.bindingCount = 1;
    layout.pBindings = &binding;
    check(vkCreateDescriptorSetLayout(device, &layout, nullptr, &layout_), "vkCreateDescriptorSetLayout");

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, capacity_};
    VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.flags = VK_DESCRIPTOR_POOL_CREATE_UPDATE_AFTER_BIND_BIT;
    pool.maxSets = 1;
    pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    check(vkCreateDescriptorPool(device, &pool, nullptr, &pool_), "vkCreateDescriptorPool");

    VkDescriptorSetAllocateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    set.descriptorPool = pool_;
    set.descriptorSetCount = 1;
    set.pSetLayouts = &layout_;
    check(vkAllocateDescriptorSets(device, &set, &set_), "vkAllocateDescriptorSets");
}

BindlessTable::~BindlessTable() {
    for (const auto& [key, sampler] : samplers_) vkDestroySampler(device_, sampler, nullptr);
    vkDestroyDescriptorPool(device_, pool_, nullptr);
    vkDestroyDescriptorSetLayout(device_, layout_, nullptr);
}

VkSampler BindlessTable::sampler(SamplerMode mode, VkFilter filter) {
    VkSampler& sampler = samplers_[{mode.u, mode.v, filter}];
    if (sampler) return sampler;
    VkSamplerCreateInfo info{VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
    info.magFilter = info.minFilter = filter;
    info.mipmapMode = filter == VK_FILTER_LINEAR ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = mode.u;
    info.addressModeV = mode.v;
    info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    info.maxLod = VK_LOD_CLAMP_NONE;
    info.borderColor = VK_BORDER_COLOR_FLOAT_TRANSPARENT_BLACK;
    check(vkCreateSampler(device_, &info, nullptr, &sampler), "vkCreateSampler");
    return sampler;
}

uint32_t BindlessTable::add(VkImageView view, SamplerMode mode, VkFilter filter) {
    if (free_.empty() && used_ == capacity_)
        throw inputError("too many textures", fmt::format("the device's table holds {}", capacity_),
                         "use fewer or merge some");
    const VkDescriptorImageInfo image{sampler(mode, filter), view, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    uint32_t index = used_;
    if (free_.empty()) {
        ++used_;
    } else {
        index = free_.back();
        free_.pop_back();
    }
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set_;
    write.dstArrayElement = index;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    write.pImageInfo = &image;
    vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
    return index;
}

} // namespace trilume::gpu
