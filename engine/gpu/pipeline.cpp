#include "core/clock.h"
#include "core/log.h"
#include "core/task_pool.h"
#include "gpu/device_impl.h"
#include "gpu/shader_compiler.h"

#include <algorithm>

namespace trilume::gpu {

Pipeline::Pipeline() = default;
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

const PipelineCost& Pipeline::cost() const { return impl_->cost; }

Pipeline::Impl::~Impl() {
    device.retire([owner = &device, program = program] { owner->pipelines.destroy(program); });
}

Pipeline Device::createPipeline(const ShaderSource& source) {
    Stopwatch watch;
    const ShaderModule module = compileShader(source);
    const double spirvMs = watch.restart();
    const Program program = impl_->pipelines.create(module, source);
    Pipeline pipeline;
    pipeline.impl_ = std::make_unique<Pipeline::Impl>(*impl_);
    pipeline.impl_->program = program;
    pipeline.impl_->usesTopLevel = module.usesTopLevel;
    std::ranges::copy(module.localSize, pipeline.impl_->localSize);
    pipeline.impl_->cost = {.name = source.path, .spirvMs = spirvMs, .driverMs = watch.ms()};
    return pipeline;
}

void Device::dispatchNothing(const Pipeline& pipeline) {
    if (pipeline.impl_->usesTopLevel && !impl_->topLevels[0]) return; // nothing to bind yet
    const std::scoped_lock lock(impl_->firstDispatches);
    const Submission submission = submit([&](Commands& commands) {
        commands.timestamp(0);
        commands.bind(*pipeline.impl_);
        vkCmdDispatch(commands.handle(), 0, 0, 0);
        commands.timestamp(1);
    });
    wait(submission);
    PipelineCost& cost = pipeline.impl_->cost;
    cost.dispatchMs = timestamps(submission)[1];
    log::debug("pipeline {}: SPIR-V {:.1f} ms, driver {:.1f} ms, first dispatch {:.1f} ms", cost.name, cost.spirvMs,
               cost.driverMs, cost.dispatchMs);
}

std::vector<Pipeline> Device::createPipelines(std::span<const ShaderSource> sources) {
    std::vector<Pipeline> pipelines(sources.size());
    TaskPool::shared().parallelFor(sources.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            pipelines[i] = createPipeline(sources[i]);
            dispatchNothing(pipelines[i]);
        }
    });
    return pipelines;
}

} // namespace trilume::gpu
