#include "gpu/shader_objects.h"

#include "core/file.h"
#include "gpu/cache_file.h"
#include "gpu/result.h"

#include <fmt/core.h>

namespace trilume::gpu {
namespace {

/// Binaries follow the layouts of descriptor sets, which no hash sees: grow this with them.
constexpr uint64_t kLayoutVersion = 1;

template<class Function>
Function load(VkDevice device, const char* name) {
    return reinterpret_cast<Function>(vkGetDeviceProcAddr(device, name));
}

} // namespace

ShaderObjects::ShaderObjects(VkDevice device, uint64_t key, VkPushConstantRange push)
    : device_(device), key_(key), push_(push), create_(load<PFN_vkCreateShadersEXT>(device, "vkCreateShadersEXT")),
      destroy_(load<PFN_vkDestroyShaderEXT>(device, "vkDestroyShaderEXT")),
      binary_(load<PFN_vkGetShaderBinaryDataEXT>(device, "vkGetShaderBinaryDataEXT")),
      bind_(load<PFN_vkCmdBindShadersEXT>(device, "vkCmdBindShadersEXT")) {}

VkShaderEXT ShaderObjects::create(std::span<const uint32_t> spirv, const VkSpecializationInfo& specialization,
                                  std::span<const VkDescriptorSetLayout> sets, const std::string& name) const {
    VkShaderCreateInfoEXT info{};
    info.sType = VK_STRUCTURE_TYPE_SHADER_CREATE_INFO_EXT;
    info.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.pName = "main";
    info.setLayoutCount = static_cast<uint32_t>(sets.size());
    info.pSetLayouts = sets.data();
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &push_;
    info.pSpecializationInfo = specialization.mapEntryCount > 0 ? &specialization : nullptr;
    const auto createFrom = [&](VkShaderCodeTypeEXT type, std::span<const std::byte> code, VkShaderEXT& shader) {
        info.codeType = type;
        info.codeSize = code.size();
        info.pCode = code.data();
        return create_(device_, 1, &info, nullptr, &shader);
    };

    const std::span special(static_cast<const std::byte*>(specialization.pData), specialization.dataSize);
    const uint64_t key = hashBytes(special, hashBytes(std::as_bytes(spirv), key_ + kLayoutVersion));
    const std::string entry = fmt::format("shaders/{:016x}.bin", key);
    VkShaderEXT shader = VK_NULL_HANDLE;
    if (const auto kept = readCacheFile(entry, key))
        if (createFrom(VK_SHADER_CODE_TYPE_BINARY_EXT, *kept, shader) == VK_SUCCESS && shader) return shader;

    check(createFrom(VK_SHADER_CODE_TYPE_SPIRV_EXT, std::as_bytes(spirv), shader), "vkCreateShadersEXT for " + name);
    size_t size = 0;
    std::vector<std::byte> binary;
    if (binary_(device_, shader, &size, nullptr) == VK_SUCCESS) binary.resize(size);
    if (size > 0 && binary_(device_, shader, &size, binary.data()) == VK_SUCCESS) writeCacheFile(entry, key, binary);
    return shader;
}

void ShaderObjects::bind(VkCommandBuffer commands, VkShaderEXT shader) const {
    constexpr VkShaderStageFlagBits kStage = VK_SHADER_STAGE_COMPUTE_BIT;
    bind_(commands, 1, &kStage, &shader);
}

} // namespace trilume::gpu
