#pragma once

#include "render/renderer.h"

#include <map>

namespace trilume {

struct Engine::Impl {
    /// Compiled on first use and kept for all views.
    const gpu::Pipeline& pipeline(const gpu::ShaderSource& source);
    /// Compiles together those that there are not yet.
    void createPipelines(std::vector<gpu::ShaderSource> sources);
    /// Uploaded on first use.
    VkDeviceAddress bsdfTables();

    Registry registry;
    std::unique_ptr<gpu::Device> device;
    std::map<std::string, gpu::Pipeline> pipelines;
    gpu::Buffer bsdfTableBuffer;
    gpu::Tracer tracer = gpu::Tracer::Compute;
    double deviceMs = 0;
    double pipelineMs = 0; ///< spent in creating pipelines so far
};

} // namespace trilume
