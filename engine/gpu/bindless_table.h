#pragma once

#include "gpu/adapter.h"

#include <map>

namespace trilume::gpu {

/// Set 0, binding 0: `sampler2D textures[]`, partially bound and updated while in use.
class BindlessTable {
public:
    static constexpr uint32_t kNone = UINT32_MAX;

    BindlessTable(const Adapter& adapter, VkDevice device);
    ~BindlessTable();
    BindlessTable(const BindlessTable&) = delete;
    BindlessTable& operator=(const BindlessTable&) = delete;

    VkDescriptorSetLayout layout() const { return layout_; }
    VkDescriptorSet set() const { return set_; }

    /// Enters a view (in SHADER_READ_ONLY_OPTIMAL) and returns its index. Throws inputError when the table is full.
    uint32_t add(VkImageView view, SamplerMode mode, VkFilter filter);
    /// The index may be given out again: no later submission uses it.
    void remove(uint32_t index) { free_.push_back(index); }

private:
    VkSampler sampler(SamplerMode mode, VkFilter filter);

    VkDevice device_;
    uint32_t capacity_, used_ = 0;
    VkDescriptorSetLayout layout_ = VK_NULL_HANDLE;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    std::vector<uint32_t> free_;
    std::map<std::tuple<int, int, int>, VkSampler> samplers_;
};

} // namespace trilume::gpu
