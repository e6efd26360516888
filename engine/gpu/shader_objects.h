#pragma once

#include "gpu/adapter.h"
#include "gpu/shader_object_extension.h"

#include <span>

namespace trilume::gpu {

/// Shaders without pipelines (VK_EXT_shader_object). Mesa's lavapipe keeps nothing in a pipeline cache and spends a
/// second of each start on the front end of some 20 kernels; binaries of shader objects keep what that makes of them.
class ShaderObjects {
public:
    /// `key` names adapter and driver build: binaries of others are of no use.
    ShaderObjects(VkDevice device, uint64_t key, VkPushConstantRange push);

    /// From the binary that an earlier run left, or compiled and kept for the next. May be called by several threads
    /// at once.
    VkShaderEXT create(std::span<const uint32_t> spirv, const VkSpecializationInfo& specialization,
                       std::span<const VkDescriptorSetLayout> sets, const std::string& name) const;
    void destroy(VkShaderEXT shader) const { destroy_(device_, shader, nullptr); }
    void bind(VkCommandBuffer commands, VkShaderEXT shader) const;

private:
    VkDevice device_;
    uint64_t key_;
    VkPushConstantRange push_;
    PFN_vkCreateShadersEXT create_;
    PFN_vkDestroyShaderEXT destroy_;
    PFN_vkGetShaderBinaryDataEXT binary_;
    PFN_vkCmdBindShadersEXT bind_;
};

} // namespace trilume::gpu
