#include "render/engine_impl.h"

#include "core/clock.h"
#include "core/error.h"
#include "graph/aov.h"
#include "render/bsdf_tables.h"

#include <set>

namespace trilume {

namespace {

gpu::Tracer chooseTracer(gpu::Tracer wanted, const gpu::Device& device) {
    if (wanted == gpu::Tracer::Query && !device.rayQuery())
        throw inputError("no ray queries", "device " + device.info().name,
                         "use --tracer compute, or a driver with VK_KHR_ray_query");
    if (wanted != gpu::Tracer::Auto) return wanted;
    // Software drivers trace rays more slowly than the compute kernel does (engine/rt/README.md).
    return device.rayQuery() && !device.isCpu() ? gpu::Tracer::Query : gpu::Tracer::Compute;
}

std::string keyOf(const gpu::ShaderSource& source) {
    std::string key = source.path;
    for (const auto& [name, value] : source.defines) key.append(" ").append(name).append("=").append(value);
    for (const uint32_t value : source.specialization) key.append(" ").append(std::to_string(value));
    return key;
}

/// Rows that belong to the frame rather than to one node.
void addFrameParams(Registry& registry) {
    registry.addParam(
        {.name = "sampler.sequence",
         .defaultValue = std::string("sobol"),
         .choices = {"sobol", "independent"},
         .doc = "Random numbers: Owen-scrambled Sobol points, or independent (unbiased both; more noise).",
         .resetsHistory = true});
    registry.addParam({.name = "light.selection",
                       .defaultValue = std::string("power"),
                       .choices = {"power", "uncompensated"},
                       .doc = "How sampled light is weighted: power divides by the probability of choosing the light; "
                              "uncompensated does not, which darkens scenes of N lights by up to N, as in the paper.",
                       .resetsHistory = true});
    registry.addParam({.name = std::string(graph::kAovParam),
                       .defaultValue = int64_t{0},
                       .minimum = 0,
                       .maximum = static_cast<double>((1u << graph::kAovs.size()) - 1),
                       .doc = "Which AOVs are averaged beside the picture, one bit each; set by the application.",
                       .cost = ParamCost::Structural});
}

} // namespace

Engine::Engine(const EngineOptions& options) : impl_(std::make_unique<Impl>()) {
    const Stopwatch watch;
    impl_->device = std::make_unique<gpu::Device>(options.device);
    impl_->tracer = chooseTracer(options.tracer, *impl_->device);
    addFrameParams(impl_->registry);
    impl_->deviceMs = watch.ms();
}

Engine::~Engine() {
    try {
        impl_->device->waitIdle();
    } catch (const Error&) {
        // A lost device has nothing left to wait for, and whoever rendered was told.
    }
}

Registry& Engine::registry() { return impl_->registry; }
gpu::Device& Engine::device() { return *impl_->device; }
gpu::Tracer Engine::tracer() const { return impl_->tracer; }
double Engine::deviceMs() const { return impl_->deviceMs; }

std::vector<gpu::PipelineCost> Engine::pipelineCosts() const {
    std::vector<gpu::PipelineCost> costs;
    for (const auto& [key, pipeline] : impl_->pipelines) costs.push_back(pipeline.cost());
    return costs;
}

const gpu::Pipeline& Engine::Impl::pipeline(const gpu::ShaderSource& source) {
    const std::string key = keyOf(source);
    const auto it = pipelines.find(key);
    if (it != pipelines.end()) return it->second;
    const Stopwatch watch;
    gpu::Pipeline& pipeline = pipelines[key] = device->createPipeline(source);
    pipelineMs += watch.ms();
    return pipeline;
}

void Engine::Impl::createPipelines(std::vector<gpu::ShaderSource> sources) {
    const Stopwatch watch;
    std::set<std::string> keys;
    std::erase_if(sources, [&](const gpu::ShaderSource& source) {
        const std::string key = keyOf(source);
        return pipelines.contains(key) || !keys.insert(key).second;
    });
    std::vector<gpu::Pipeline> created = device->createPipelines(sources);
    for (size_t i = 0; i < sources.size(); ++i) pipelines[keyOf(sources[i])] = std::move(created[i]);
    pipelineMs += watch.ms();
}

VkDeviceAddress Engine::Impl::bsdfTables() {
    if (!bsdfTableBuffer)
        bsdfTableBuffer =
            device->createBufferFrom(std::span<const uint32_t>(trilume::bsdfTables()), "microfacet energy tables");
    return bsdfTableBuffer.address();
}

} // namespace trilume
