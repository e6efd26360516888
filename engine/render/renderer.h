#pragma once

#include "gpu/device.h"
#include "graph/graph.h"
#include "plugin/registry.h"
#include "scene/scene.h"

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace trilume {

/// Owns the device and what is shared by all views of all scenes.
struct EngineOptions {
    gpu::DeviceOptions device;
    gpu::Tracer tracer = gpu::Tracer::Auto;
};

struct NodeStats {
    std::string name;
    std::string state; ///< run, skipped, idle
    std::string reason;
    double ms = 0;
};

struct ProbeStats {
    uint32_t total = 0, active = 0; ///< of the last frame
    uint32_t updated = 0;           ///< updates in all frames averaged
};

struct FrameStats {
    double ms = 0;       ///< wall time of rendering, loading and pipeline creation excluded
    double warmupMs = 0; ///< of it, before the frames that are averaged
    /// Processor time of the calling thread: follows the scene, compiles the graph, records, submits, and creates
    /// pipelines that prepare() did not. The first picture's scene was followed in prepare().
    double hostMs = 0;
    uint32_t spp = 0; ///< frames averaged, those of calls before included where the average went on
    std::vector<NodeStats> nodes;
    uint64_t rays = 0;
    uint32_t blasBuilt = 0, blasRefit = 0, tlasBuilt = 0;
    uint64_t uploadedBytes = 0; ///< tables, meshes and textures; each frame's constants are not counted
    ProbeStats probes;
    uint64_t photons = 0;
    uint64_t nonfinite = 0; ///< pixels whose sample was not finite: dropped and counted
    size_t memoryBytes = 0;
    double effort = 1;                ///< of this picture: below 1 where View::setTargetMs took some
    std::vector<std::string> unowned; ///< path classes that the scene may have and no node computes
};

struct StartupStats {
    double deviceMs = 0, loadMs = 0, pipelinesMs = 0, firstFrameMs = 0;
    std::vector<gpu::PipelineCost> pipelines;
};

class Engine {
public:
    explicit Engine(const EngineOptions& options);
    ~Engine();
    Registry& registry();
    gpu::Device& device();
    gpu::Tracer tracer() const; ///< never Auto
    double deviceMs() const;    ///< spent in creating the device
    /// Of all pipelines so far, by name.
    std::vector<gpu::PipelineCost> pipelineCosts() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
    friend class View;
};

/// One camera's picture of one scene by one technique.
class View {
public:
    /// `camera` as chooseCamera takes it.
    View(Engine& engine, Scene& scene, uint32_t width, uint32_t height, std::string_view camera);
    ~View();

    void setTechnique(std::string_view name);
    ParamSet& params();
    void setNodeEnabled(std::string_view node, bool enabled);
    void setSeed(uint64_t seed);                  ///< and begins the sequence of random numbers anew
    void setAovs(std::vector<std::string> names); ///< kept and averaged from the next frame on

    /// Above 0: keeps the time of a frame within this, where that takes no more than fewer probe rays, photons or light
    /// candidates, whatever the technique has of them. Pictures then depend on how fast they were rendered. 0: off.
    void setTargetMs(double ms);

    /// The registry's image filter of this name is applied to each finished picture, with the guides that it needs;
    /// empty: none. Throws inputError when it is unknown or what it needs is missing.
    void setImageFilter(std::string_view name);

    /// Uploads the scene and compiles the graph and its pipelines now rather than with the first frame. Returns the
    /// milliseconds spent on pipelines.
    double prepare();

    struct RenderOptions {
        uint32_t spp = 1;
        double seconds = 0; ///< above 0: in place of spp; at least one frame
        uint32_t warmup = 0;
        /// Above 0: while neither scene, camera nor parameters change, calls go on with one average, until it holds so
        /// many frames; from then on they return it and render nothing. For viewports: output frames of a sequence have
        /// noise of their own.
        uint32_t restAfter = 0;
        const std::atomic<bool>* cancel = nullptr; ///< ends early, keeping what was averaged
        std::function<void(double done)> progress; ///< 0..1
    };
    /// Brings the device copy up to date with the scene, renders and averages. Linear RGBA, row 0 at the top.
    ImageData render(const RenderOptions& options);
    /// color (the picture again), direct, indirect, caustic, emission, albedo, normal, depth, motion, variance; 3
    /// channels (color 4, depth and variance 1, motion 2). Throws inputError when the technique doesn't produce it.
    ImageData aov(std::string_view name);
    const FrameStats& stats() const;
    /// The compiled graph, as DOT or JSON.
    std::string dumpGraph(bool json) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace trilume
