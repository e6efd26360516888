#pragma once

#include "gpu/adapter.h"

#include <atomic>

namespace trilume::gpu {

struct ShaderModule;

/// Pipeline layouts shared by all pipelines, and the driver's pipeline cache, kept on disk.
class PipelineLibrary {
public:
    PipelineLibrary(const Adapter& adapter, VkDevice device, VkDescriptorSetLayout bindless);
    ~PipelineLibrary();
    PipelineLibrary(const PipelineLibrary&) = delete;
    PipelineLibrary& operator=(const PipelineLibrary&) = delete;

    /// May be called by several threads at once.
    VkPipeline create(const ShaderModule& module, const ShaderSource& source);
    VkPipelineLayout layout(bool topLevel) const { return topLevel ? topLevelLayout_ : plainLayout_; }
    /// Set 1; null without ray queries.
    VkDescriptorSetLayout topLevelSetLayout() const { return topLevelSetLayout_; }
    uint32_t pushBytes() const { return pushBytes_; }

    /// Writes the cache to disk, merged with what another process wrote meanwhile. Does nothing when nothing is new.
    void save();

private:
    VkPipelineLayout createLayout(std::vector<VkDescriptorSetLayout> sets) const;
    VkPipelineCache load() const;

    const Adapter& adapter_;
    VkDevice device_;
    uint32_t pushBytes_; ///< of every layout
    VkDescriptorSetLayout topLevelSetLayout_ = VK_NULL_HANDLE;
    VkPipelineLayout plainLayout_ = VK_NULL_HANDLE, topLevelLayout_ = VK_NULL_HANDLE;
    VkPipelineCache cache_ = VK_NULL_HANDLE;
    std::atomic<bool> changed_ = false;
};

} // namespace trilume::gpu
