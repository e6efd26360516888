#pragma once

#include "gpu/shader_objects.h"

#include <atomic>
#include <optional>

namespace trilume::gpu {

struct ShaderModule;

/// What a command buffer binds: a pipeline, or on devices that keep shaders the shader alone.
struct Program {
    VkPipeline pipeline = VK_NULL_HANDLE;
    VkShaderEXT shader = VK_NULL_HANDLE;
};

/// Pipeline layouts shared by all pipelines, and the driver's pipeline cache, kept on disk.
class PipelineLibrary {
public:
    PipelineLibrary(const Adapter& adapter, VkDevice device, VkDescriptorSetLayout bindless);
    ~PipelineLibrary();
    PipelineLibrary(const PipelineLibrary&) = delete;
    PipelineLibrary& operator=(const PipelineLibrary&) = delete;

    /// May be called by several threads at once.
    Program create(const ShaderModule& module, const ShaderSource& source);
    void destroy(const Program& program) const;
    void bind(VkCommandBuffer commands, const Program& program) const;
    VkPipelineLayout layout(bool topLevel) const { return topLevel ? topLevelLayout_ : plainLayout_; }
    /// Set 1; null without ray queries.
    VkDescriptorSetLayout topLevelSetLayout() const { return topLevelSetLayout_; }
    uint32_t pushBytes() const { return pushBytes_; }

    /// Writes the cache to disk, merged with what another process wrote meanwhile. Does nothing when nothing is new.
    void save();

private:
    VkPipeline createPipeline(const ShaderModule& module, const VkSpecializationInfo& specialization,
                              const std::string& name) const;
    VkPipelineLayout createLayout(std::vector<VkDescriptorSetLayout> sets) const;
    VkPipelineCache load() const;

    const Adapter& adapter_;
    VkDevice device_;
    uint32_t pushBytes_; ///< of every layout
    VkDescriptorSetLayout bindlessSetLayout_, topLevelSetLayout_ = VK_NULL_HANDLE;
    VkPipelineLayout plainLayout_ = VK_NULL_HANDLE, topLevelLayout_ = VK_NULL_HANDLE;
    VkPipelineCache cache_ = VK_NULL_HANDLE; ///< null where shaders are kept
    std::optional<ShaderObjects> shaders_;
    std::atomic<bool> changed_ = false;
};

} // namespace trilume::gpu
