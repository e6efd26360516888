#include "gpu/pipeline_library.h"

#include "core/file.h"
#include "gpu/cache_file.h"
#include "gpu/result.h"
#include "gpu/shader_compiler.h"

#include <fmt/core.h>

#include <algorithm>

namespace trilume::gpu {
namespace {

constexpr uint32_t kMaximumPushBytes = 256;

/// Pipelines of another device or driver build are of no use: their entry gets another name and key.
uint64_t cacheKey(const Adapter& adapter) {
    const uint32_t ids[] = {adapter.properties.vendorID, adapter.properties.deviceID, adapter.properties.driverVersion};
    uint64_t key = hashBytes(std::as_bytes(std::span(ids)));
    key = hashBytes(std::as_bytes(std::span(adapter.driverUuid)), key);
    return hashBytes(std::as_bytes(std::span(adapter.properties.pipelineCacheUUID)), key);
}

std::string cacheName(const Adapter& adapter) { return fmt::format("pipelines/{:016x}.bin", cacheKey(adapter)); }

} // namespace

PipelineLibrary::PipelineLibrary(const Adapter& adapter, VkDevice device, VkDescriptorSetLayout bindless)
    : adapter_(adapter), device_(device),
      pushBytes_(std::min(adapter.properties.limits.maxPushConstantsSize, kMaximumPushBytes)),
      bindlessSetLayout_(bindless) {
    plainLayout_ = createLayout({bindless});
    if (adapter.info.rayQuery) {
        const auto structure = [](uint32_t binding) {
            return VkDescriptorSetLayoutBinding{binding, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 1,
                                                VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
        };
        const VkDescriptorSetLayoutBinding bindings[] = {structure(0), structure(1)}; // the scene now, and last frame
        VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        set.bindingCount = 2;
        set.pBindings = bindings;
        check(vkCreateDescriptorSetLayout(device, &set, nullptr, &topLevelSetLayout_), "vkCreateDescriptorSetLayout");
        topLevelLayout_ = createLayout({bindless, topLevelSetLayout_});
    }
    if (adapter.keepsShaders)
        shaders_.emplace(device, cacheKey(adapter), VkPushConstantRange{VK_SHADER_STAGE_COMPUTE_BIT, 0, pushBytes_});
    else
        cache_ = load();
}

PipelineLibrary::~PipelineLibrary() {
    save();
    vkDestroyPipelineCache(device_, cache_, nullptr);
    vkDestroyPipelineLayout(device_, topLevelLayout_, nullptr);
    vkDestroyPipelineLayout(device_, plainLayout_, nullptr);
    vkDestroyDescriptorSetLayout(device_, topLevelSetLayout_, nullptr);
}

VkPipelineLayout PipelineLibrary::createLayout(std::vector<VkDescriptorSetLayout> sets) const {
    const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, pushBytes_};
    VkPipelineLayoutCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    info.setLayoutCount = static_cast<uint32_t>(sets.size());
    info.pSetLayouts = sets.data();
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &push;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    check(vkCreatePipelineLayout(device_, &info, nullptr, &layout), "vkCreatePipelineLayout");
    return layout;
}

VkPipelineCache PipelineLibrary::load() const {
    const auto bytes = readCacheFile(cacheName(adapter_), cacheKey(adapter_));
    VkPipelineCacheCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
    if (bytes) {
        info.initialDataSize = bytes->size();
        info.pInitialData = bytes->data();
    }
    VkPipelineCache cache = VK_NULL_HANDLE;
    check(vkCreatePipelineCache(device_, &info, nullptr, &cache), "vkCreatePipelineCache");
    return cache;
}

void PipelineLibrary::save() {
    if (!changed_.exchange(false)) return;
    const VkPipelineCache onDisk = load();
    vkMergePipelineCaches(device_, cache_, 1, &onDisk);
    vkDestroyPipelineCache(device_, onDisk, nullptr);

    size_t size = 0;
    if (vkGetPipelineCacheData(device_, cache_, &size, nullptr) != VK_SUCCESS) return;
    std::vector<std::byte> bytes(size);
    if (vkGetPipelineCacheData(device_, cache_, &size, bytes.data()) != VK_SUCCESS) return;
    writeCacheFile(cacheName(adapter_), cacheKey(adapter_), std::span(bytes).first(size));
}

Program PipelineLibrary::create(const ShaderModule& module, const ShaderSource& source) {
    std::vector<VkSpecializationMapEntry> entries;
    for (uint32_t i = 0; i < source.specialization.size(); ++i)
        entries.push_back({i, i * static_cast<uint32_t>(sizeof(uint32_t)), sizeof(uint32_t)});
    const VkSpecializationInfo specialization{static_cast<uint32_t>(entries.size()), entries.data(),
                                              entries.size() * sizeof(uint32_t), source.specialization.data()};
    if (shaders_) {
        const VkDescriptorSetLayout sets[] = {bindlessSetLayout_, topLevelSetLayout_};
        const auto used = std::span(sets).first(module.usesTopLevel ? 2 : 1);
        return {.shader = shaders_->create(module.spirv, specialization, used, source.path)};
    }
    const VkPipeline pipeline = createPipeline(module, specialization, source.path);
    changed_ = true;
    return {.pipeline = pipeline};
}

void PipelineLibrary::destroy(const Program& program) const {
    if (program.shader) shaders_->destroy(program.shader);
    vkDestroyPipeline(device_, program.pipeline, nullptr);
}

void PipelineLibrary::bind(VkCommandBuffer commands, const Program& program) const {
    if (program.shader)
        shaders_->bind(commands, program.shader);
    else
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.pipeline);
}

VkPipeline PipelineLibrary::createPipeline(const ShaderModule& module, const VkSpecializationInfo& specialization,
                                           const std::string& name) const {
    VkShaderModuleCreateInfo shader{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    shader.codeSize = module.spirv.size() * sizeof(uint32_t);
    shader.pCode = module.spirv.data();
    VkShaderModule shaderModule = VK_NULL_HANDLE;
    check(vkCreateShaderModule(device_, &shader, nullptr, &shaderModule), "vkCreateShaderModule");

    VkComputePipelineCreateInfo info{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = shaderModule;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = specialization.mapEntryCount > 0 ? &specialization : nullptr;
    info.layout = layout(module.usesTopLevel);

    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result = vkCreateComputePipelines(device_, cache_, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device_, shaderModule, nullptr);
    check(result, "vkCreateComputePipelines for " + name);
    return pipeline;
}

} // namespace trilume::gpu
