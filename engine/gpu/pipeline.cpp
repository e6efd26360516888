#include "core/task_pool.h"
#include "gpu/device_impl.h"
#include "gpu/shader_compiler.h"

#include <algorithm>

namespace trilume::gpu {

Pipeline::Pipeline() = default;
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

Pipeline::Impl::~Impl() {
    if (handle)
        device.retire([owner = &device, handle = handle] { vkDestroyPipeline(owner->device.handle, handle, nullptr); });
}

Pipeline Device::createPipeline(const ShaderSource& source) {
    const ShaderModule module = compileShader(source);
    Pipeline pipeline;
    pipeline.impl_ = std::make_unique<Pipeline::Impl>(*impl_);
    pipeline.impl_->name = source.path;
    pipeline.impl_->usesTopLevel = module.usesTopLevel;
    std::ranges::copy(module.localSize, pipeline.impl_->localSize);
    pipeline.impl_->handle = impl_->pipelines.create(module, source);
    return pipeline;
}

std::vector<Pipeline> Device::createPipelines(std::span<const ShaderSource> sources) {
    std::vector<Pipeline> pipelines(sources.size());
    TaskPool::shared().parallelFor(sources.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) pipelines[i] = createPipeline(sources[i]);
    });
    return pipelines;
}

} // namespace trilume::gpu
