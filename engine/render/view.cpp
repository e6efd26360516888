#include "core/clock.h"
#include "core/error.h"
#include "graph/aov.h"
#include "graph/dump.h"
#include "graph/execute.h"
#include "render/camera.h"
#include "render/effort_governor.h"
#include "render/engine_impl.h"
#include "render/gpu_scene.h"
#include "shared/passes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <deque>
#include <set>
#include <utility>

namespace trilume {

namespace {

constexpr uint32_t kFramesInFlight = 2;

/// As it lies in device memory: the constants and what they point to.
struct FrameData {
    shared::FrameConstants constants;
    shared::SceneTable previousScene;
};

} // namespace

struct View::Impl {
    Impl(Engine& engine, Engine::Impl& engineImpl, Scene& scene, uint32_t width, uint32_t height)
        : engine(engine), shared(engineImpl), device(engine.device()), gpuScene(device, engine.tracer(), scene),
          executor(device), params(engine.registry().params()), width(width), height(height) {
        for (FrameSlot& slot : slots) {
            slot.constants = device.createBuffer(sizeof(FrameData), gpu::Memory::Upload, "frame constants");
            slot.counters =
                device.createBuffer(shared::kCounterCount * sizeof(uint32_t), gpu::Memory::Readback, "frame counters");
        }
    }

    struct FrameSlot {
        gpu::Buffer constants, counters;
        gpu::Submission submission;
        bool pending = false;
    };

    void setTechnique(const Technique& technique);
    void buildGraph();
    bool graphIsCurrent() const;
    /// Whether a frame now would be one more sample of the last picture.
    bool pictureIsCurrent() const { return continues && graphIsCurrent() && !facts.sceneChanged && !facts.cameraMoved; }
    /// The average, filtered where there is a filter.
    ImageData finishedPicture();
    std::vector<std::pair<std::string, std::string>> shaderDefines() const;
    FrameData frameData(const FrameSlot& slot, uint32_t sampleIndex) const;
    using FindPipeline = std::function<const gpu::Pipeline&(const gpu::ShaderSource&)>;
    /// `find` is given sources with all that the scene defines.
    graph::FrameInput frameInput(const FrameSlot& slot, uint32_t sampleIndex, FindPipeline find) const;
    void submitFrame(uint32_t sampleIndex);
    void collect(FrameSlot& slot);
    void collectAll();
    /// Follows the scene; builds are counted into the next picture's statistics.
    void syncScene();
    template<class T>
    std::vector<T> readPlane(std::string_view name);
    ImageData picture();
    ImageData averagedAov(const graph::Aov& aov);
    /// Those that nodes make: what was asked for, and the filter's guides.
    std::vector<std::string_view> planeAovs() const;
    void requestAovs();

    Engine& engine;
    Engine::Impl& shared;
    gpu::Device& device;
    GpuScene gpuScene;
    graph::GraphExecutor executor;
    ParamSet params;
    uint32_t width, height;
    Entity camera;
    uint64_t seed = 0;

    const Technique* technique = nullptr;
    std::vector<std::unique_ptr<graph::Node>> nodes;
    std::vector<graph::GraphNode> graphNodes;
    std::set<std::string, std::less<>> disabled;
    std::vector<std::string> aovs;
    ImageFilter filter;
    std::optional<ImageData> filtered; ///< the picture, where there is a filter

    bool graphBuilt = false, builtCameraMoved = false;
    uint64_t builtParams = 0, builtScene = 0, historyParams = 0;
    std::array<FrameSlot, kFramesInFlight> slots;
    uint32_t frameIndex = 0;
    uint32_t averaged = 0;
    bool continues = false;                      ///< the average may go on: it is whole, and of this seed
    bool rendered = true;                        ///< the last call ended without an error
    bool repeats = false;                        ///< the next frame shows what the last one did
    graph::SceneFacts facts;                     ///< of the scene, and of this view's camera
    std::optional<shared::Camera> pictureCamera; ///< of this picture
    shared::Camera previousCamera{};             ///< of the picture before
    bool followsChange = false;                  ///< the next frame is the first since something changed
    rt::AccelStats builds;                       ///< since the last picture
    uint64_t preparedBytes = 0;                  ///< uploaded by prepare() since then
    std::optional<EffortGovernor> governor;
    FrameStats stats;
};

View::View(Engine& engine, Scene& scene, uint32_t width, uint32_t height, std::string_view camera) {
    if (width == 0 || height == 0 || width > 32768 || height > 32768)
        throw inputError("picture size out of range", std::to_string(width) + " x " + std::to_string(height),
                         "choose 1 to 32768 pixels a side");
    scene.updateTransforms();
    const Entity entity = chooseCamera(scene, camera);
    impl_ = std::make_unique<Impl>(engine, *engine.impl_, scene, width, height);
    impl_->camera = entity;
    setTechnique(engine.registry().defaultTechnique().name);
}

View::~View() {
    try {
        impl_->device.waitIdle();
    } catch (const Error&) {
        // A lost device has nothing left to wait for, and whoever rendered was told.
    }
}

void View::setTechnique(std::string_view name) { impl_->setTechnique(impl_->engine.registry().technique(name)); }
ParamSet& View::params() { return impl_->params; }
void View::setSeed(uint64_t seed) {
    impl_->seed = seed;
    impl_->frameIndex = 0;
    impl_->continues = false;
}
void View::setTargetMs(double ms) {
    impl_->governor.reset();
    if (ms > 0) impl_->governor.emplace(ms);
    impl_->params.setEffort(1);
}
const FrameStats& View::stats() const { return impl_->stats; }

void View::Impl::setTechnique(const Technique& wanted) {
    nodes.clear();
    graphNodes.clear();
    graphBuilt = false;
    for (const std::string& name : wanted.nodes) {
        nodes.push_back(engine.registry().node(name).create());
        graphNodes.push_back({name, nodes.back().get(), disabled.count(name) == 0});
    }
    params.clearDefaults();
    for (const auto& [name, value] : wanted.defaults) params.setDefault(name, value);
    technique = &wanted;
}

void View::setNodeEnabled(std::string_view node, bool enabled) {
    const auto it = std::find_if(impl_->graphNodes.begin(), impl_->graphNodes.end(),
                                 [&](const graph::GraphNode& n) { return n.name == node; });
    if (it == impl_->graphNodes.end()) {
        std::string known;
        for (const auto& n : impl_->graphNodes) known += (known.empty() ? "" : ", ") + n.name;
        throw inputError("no such node", std::string(node) + " in technique " + impl_->technique->name,
                         "nodes are: " + known);
    }
    it->enabled = enabled;
    if (enabled)
        impl_->disabled.erase(it->name);
    else
        impl_->disabled.insert(it->name);
    impl_->graphBuilt = false;
}

void View::setAovs(std::vector<std::string> names) {
    for (const std::string& name : names) {
        if (graph::isFromSums(name) || graph::findAov(name) != graph::kAovs.end()) continue;
        std::string known(graph::kColorAov);
        for (const auto& a : graph::kAovs) known += ", " + std::string(a.name);
        throw inputError("no such AOV", name, "AOVs are: " + known + ", " + std::string(graph::kVarianceAov));
    }
    impl_->aovs = std::move(names);
    impl_->requestAovs();
}

void View::setImageFilter(std::string_view name) {
    impl_->filter = name.empty() ? ImageFilter{} : impl_->engine.registry().imageFilter(name);
    impl_->filtered.reset();
    impl_->requestAovs();
}

std::vector<std::string_view> View::Impl::planeAovs() const {
    std::vector<std::string_view> names;
    for (const std::string& name : aovs)
        if (!graph::isFromSums(name)) names.push_back(name);
    if (filter) names.insert(names.end(), {"albedo", "normal"});
    return names;
}

void View::Impl::requestAovs() {
    int64_t mask = 0;
    for (const std::string_view name : planeAovs()) mask |= int64_t{1} << (graph::findAov(name) - graph::kAovs.begin());
    params.set(graph::kAovParam, std::to_string(mask));
}

bool View::Impl::graphIsCurrent() const {
    return graphBuilt && builtParams == params.revision() && builtScene == gpuScene.revision() &&
           builtCameraMoved == facts.cameraMoved;
}

void View::Impl::buildGraph() {
    if (graphIsCurrent()) return;
    std::vector<std::string> outputs{"composite.sums"};
    for (const std::string_view aov : planeAovs()) outputs.push_back("composite.aov." + std::string(aov));
    executor.setGraph(graph::compile({graphNodes, facts, params, width, height, outputs, technique->overlapping}));
    if (historyParams != params.historyRevision()) executor.resetHistory();
    historyParams = params.historyRevision();
    builtParams = params.revision();
    builtScene = gpuScene.revision();
    builtCameraMoved = facts.cameraMoved;
    graphBuilt = true;
}

std::vector<std::pair<std::string, std::string>> View::Impl::shaderDefines() const {
    const GpuMaterials& materials = gpuScene.materials();
    const auto flag = [](bool on) { return std::string(on ? "1" : "0"); };
    std::vector<std::pair<std::string, std::string>> defines{
        {"TL_BSDF_SPECULAR", flag(materials.specular())},
        {"TL_BSDF_ROUGH", flag(materials.rough())},
        {"TL_BSDF_TRANSMISSION", flag(materials.transmissive())},
        {"TL_BSDF_CLEARCOAT", flag(materials.clearcoated())},
        {"TL_CUTOUTS", flag(materials.cutouts())},
        {"TL_TEXTURES", flag(materials.textured())},
    };
    defines.emplace_back("TL_LIGHT_KINDS", std::to_string(gpuScene.lightKinds()));
    defines.emplace_back("TL_LIGHT_TEXTURES", flag(gpuScene.texturedLights()));
    if (device.isCpu()) defines.emplace_back("TL_CPU", "1");
    if (engine.tracer() == gpu::Tracer::Query) defines.emplace_back("TL_TRACER_QUERY", "1");
    return defines;
}

FrameData View::Impl::frameData(const FrameSlot& slot, uint32_t sampleIndex) const {
    FrameData data{};
    shared::FrameConstants& constants = data.constants;
    constants.scene = gpuScene.table();
    constants.camera = *pictureCamera;
    constants.previousCamera = previousCamera;
    constants.width = width;
    constants.height = height;
    constants.frameIndex = frameIndex;
    constants.sampleIndex = sampleIndex;
    constants.seed = static_cast<uint32_t>(seed ^ seed >> 32);
    if (params.getChoice("sampler.sequence") == "sobol") constants.flags |= shared::kFrameSobol;
    if (params.getChoice("light.selection") == "uncompensated") constants.flags |= shared::kFrameUncompensated;
    constants.counters = slot.counters.address();
    if (gpuScene.materials().specular()) constants.bsdfTables = shared.bsdfTables();
    data.previousScene = followsChange ? gpuScene.previousTable() : gpuScene.table();
    constants.previousScene = slot.constants.address() + offsetof(FrameData, previousScene);
    if (followsChange) constants.flags |= shared::kFrameChanged;
    if (followsChange && gpuScene.lightsRenumbered()) {
        constants.flags |= shared::kFrameLightsRenumbered;
        constants.currentLight = gpuScene.currentLight();
        constants.previousLight = gpuScene.previousLight();
    }
    return data;
}

graph::FrameInput View::Impl::frameInput(const FrameSlot& slot, uint32_t sampleIndex, FindPipeline find) const {
    return {.nodes = graphNodes,
            .params = params,
            .facts = facts,
            .frame = slot.constants.address(),
            .sampleIndex = sampleIndex,
            .repeats = repeats,
            .pipeline = [find = std::move(find),
                         defines = shaderDefines()](const gpu::ShaderSource& source) -> const gpu::Pipeline& {
                gpu::ShaderSource specialised = source;
                specialised.defines.insert(specialised.defines.end(), defines.begin(), defines.end());
                return find(specialised);
            }};
}

void View::Impl::submitFrame(uint32_t sampleIndex) {
    FrameSlot& slot = slots[frameIndex % kFramesInFlight];
    collect(slot);
    const ThreadStopwatch host;
    const FrameData data = frameData(slot, sampleIndex);
    std::memcpy(slot.constants.mapped(), &data, sizeof(data));
    std::memset(slot.counters.mapped(), 0, slot.counters.size());

    const auto input = frameInput(slot, sampleIndex, [&](const gpu::ShaderSource& source) -> const gpu::Pipeline& {
        return shared.pipeline(source);
    });
    gpuScene.use(followsChange);
    slot.submission = device.submit([&](gpu::Commands& commands) { executor.record(commands, input); });
    slot.pending = true;
    followsChange = false;
    ++frameIndex;
    repeats = true;
    stats.hostMs += host.ms();
}

void View::Impl::collect(FrameSlot& slot) {
    if (!slot.pending) return;
    device.wait(slot.submission);
    slot.pending = false;
    const auto* counters = reinterpret_cast<const uint32_t*>(slot.counters.mapped());
    stats.rays += counters[shared::kCounterRays];
    stats.nonfinite += counters[shared::kCounterNonfinite];
    stats.photons += counters[shared::kCounterPhotons];
    stats.probes.total = counters[shared::kCounterProbes];
    stats.probes.active = counters[shared::kCounterProbesActive];
    stats.probes.updated += counters[shared::kCounterProbesUpdated];
    const std::vector<double> times = executor.passTimes(device.timestamps(slot.submission));
    for (size_t i = 0; i < times.size() && i < stats.nodes.size(); ++i) stats.nodes[i].ms += times[i];
}

void View::Impl::collectAll() {
    for (uint32_t i = 0; i < kFramesInFlight; ++i) collect(slots[(frameIndex + i) % kFramesInFlight]);
}

void View::Impl::syncScene() {
    gpuScene.update();
    const rt::AccelStats& accel = gpuScene.accelStats();
    builds.blasBuilt += accel.blasBuilt;
    builds.blasRefit += accel.blasRefit;
    builds.tlasBuilt += accel.tlasBuilt;

    // Motion is that between pictures, of things and of the camera alike, in each of the frames averaged into one.
    const Scene& scene = gpuScene.scene();
    const Camera* lens = scene.world.find<Camera>(camera);
    if (!lens)
        throw inputError("the view's camera was removed from the scene", "camera", "open a view of another camera");
    const shared::Camera now =
        makeCamera(*lens, scene.world.find<WorldTransform>(camera)->worldFromLocal, gpuScene.origin(), width, height);
    previousCamera = pictureCamera.value_or(now);
    pictureCamera = now;
    facts = gpuScene.facts();
    facts.cameraMoved = std::memcmp(&previousCamera, &now, sizeof(now)) != 0;
    facts.cameraPosition = now.position;
    repeats = false;
    followsChange = facts.sceneChanged || facts.cameraMoved;
}

double View::prepare() {
    Impl& v = *impl_;
    const uint64_t uploadedBefore = v.device.uploadedBytes();
    v.syncScene();
    v.preparedBytes += v.device.uploadedBytes() - uploadedBefore;
    v.buildGraph();
    const Stopwatch watch;
    std::vector<gpu::ShaderSource> sources;
    const gpu::Pipeline unseen;
    v.executor.rehearse(v.frameInput(v.slots[0], 0, [&](const gpu::ShaderSource& source) -> const gpu::Pipeline& {
        sources.push_back(source);
        return unseen;
    }));
    v.gpuScene.use(v.followsChange);
    v.shared.createPipelines(std::move(sources));
    v.frameIndex = 0;
    v.continues = false;
    return watch.ms();
}

ImageData View::render(const RenderOptions& options) {
    Impl& v = *impl_;
    const double pipelinesBefore = v.shared.pipelineMs;
    const uint64_t uploadedBefore = v.device.uploadedBytes();
    const Stopwatch watch;
    const ThreadStopwatch host;
    // What a call that failed has left half-done is no history.
    if (!std::exchange(v.rendered, false)) {
        v.executor.resetHistory();
        v.continues = false;
    }
    v.syncScene();
    const bool goesOn = options.restAfter > 0 && v.pictureIsCurrent();
    const bool rests = goesOn && v.averaged >= options.restAfter;
    if (v.governor && !goesOn) v.params.setEffort(v.governor->effort());
    v.buildGraph();
    const double preparing = host.ms();

    const graph::CompiledGraph& graph = v.executor.graph();
    v.stats = {};
    v.stats.hostMs = preparing;
    v.stats.effort = v.params.effort();
    for (const graph::Pass& pass : graph.passes)
        v.stats.nodes.push_back(pass.runs() && rests
                                    ? NodeStats{pass.name, "idle", "nothing changed", 0}
                                    : NodeStats{pass.name, pass.runs() ? "run" : "skipped", pass.reason, 0});
    for (const graph::PathClass c : graph.unowned) v.stats.unowned.emplace_back(graph::pathClassName(c));
    v.stats.blasBuilt = v.builds.blasBuilt;
    v.stats.blasRefit = v.builds.blasRefit;
    v.stats.tlasBuilt = v.builds.tlasBuilt;
    v.builds = {};

    const auto cancelled = [&] { return options.cancel && options.cancel->load(std::memory_order_relaxed); };
    const uint32_t warmup = goesOn ? 0 : options.warmup;
    for (uint32_t i = 0; i < warmup && !cancelled(); ++i) v.submitFrame(0);
    v.collectAll();
    v.stats.warmupMs = watch.ms() - (v.shared.pipelineMs - pipelinesBefore);
    const Stopwatch averaging;
    const uint32_t before = goesOn ? v.averaged : 0;
    uint32_t done = 0;
    const auto finished = [&] {
        if (rests) return true;
        if (done == 0) return false;
        if (options.restAfter > 0 && before + done >= options.restAfter) return true;
        return cancelled() || (options.seconds > 0 ? averaging.ms() >= 1e3 * options.seconds : done >= options.spp);
    };
    while (!finished()) {
        v.submitFrame(before + done++);
        if (options.progress)
            options.progress(options.seconds > 0 ? std::min(1.0, averaging.ms() / (1e3 * options.seconds))
                                                 : static_cast<double>(done) / options.spp);
    }
    v.collectAll();
    v.averaged = v.stats.spp = before + done;
    v.continues = v.rendered = true;
    v.stats.memoryBytes = v.device.memoryInUse();
    v.stats.uploadedBytes = std::exchange(v.preparedBytes, 0) + v.device.uploadedBytes() - uploadedBefore;
    if (done > 0) v.filtered.reset();
    ImageData picture = v.finishedPicture();
    v.stats.ms = watch.ms() - (v.shared.pipelineMs - pipelinesBefore);
    if (v.governor && done > 0) v.governor->take(v.stats.ms / (done + warmup), v.params.effortRange());
    return picture;
}

ImageData View::Impl::finishedPicture() {
    if (filter && !filtered) {
        filtered = picture();
        filter(*filtered, averagedAov(*graph::findAov("albedo")), averagedAov(*graph::findAov("normal")));
    }
    return filtered ? *filtered : picture();
}

ImageData View::Impl::picture() {
    const auto sums = readPlane<shared::PixelSums>("composite.sums");
    if (sums.empty()) throw inputError("no picture", "technique " + technique->name, "switch node composite on");
    ImageData image{width, height, 4, {}};
    image.pixels.reserve(4 * sums.size());
    for (const shared::PixelSums& s : sums) {
        for (int c = 0; c < 3; ++c) image.pixels.push_back(s.sum[c] / static_cast<float>(std::max(averaged, 1u)));
        image.pixels.push_back(1);
    }
    return image;
}

template<class T>
std::vector<T> View::Impl::readPlane(std::string_view name) {
    std::vector<T> values;
    const auto region = executor.region(name);
    if (!region) return values;
    values.resize(region.bytes / sizeof(T));
    device.download(*region.buffer, region.offset, std::as_writable_bytes(std::span(values)));
    return values;
}

ImageData View::aov(std::string_view name) {
    Impl& v = *impl_;
    const auto frames = static_cast<float>(std::max(v.averaged, 1u));
    if (name == graph::kColorAov) return v.filtered ? *v.filtered : v.picture();
    if (name == graph::kVarianceAov) {
        // Of the mean's luminance, from the sample variance.
        ImageData image{v.width, v.height, 1, {}};
        for (const auto& s : v.readPlane<shared::PixelSums>("composite.sums")) {
            const float mean = glm::dot(s.sum, glm::vec3(0.2126f, 0.7152f, 0.0722f)) / frames;
            image.pixels.push_back(frames > 1 ? std::max(0.0f, s.squares / frames - mean * mean) / (frames - 1) : 0.0f);
        }
        return image;
    }
    const auto it = graph::findAov(name);
    if (it == graph::kAovs.end()) throw inputError("no such AOV", std::string(name), "see trilume render --help");
    return v.averagedAov(*it);
}

ImageData View::Impl::averagedAov(const graph::Aov& aov) {
    ImageData image{width, height, aov.channels, readPlane<float>("composite.aov." + std::string(aov.name))};
    for (const graph::PathClass c : executor.graph().unneeded)
        if (image.pixels.empty() && aov.name == graph::pathClassName(c))
            image.pixels.resize(size_t{width} * height * aov.channels); // the scene has no such light
    if (image.pixels.empty())
        throw inputError("AOV not produced", std::string(aov.name) + " by technique " + technique->name,
                         "choose another technique, or ask for it before rendering");
    for (float& x : image.pixels) x /= static_cast<float>(std::max(averaged, 1u));
    return image;
}

std::string View::dumpGraph(bool json) const {
    const auto& graph = impl_->executor.graph();
    return json ? graph::toJson(graph) : graph::toDot(graph);
}

} // namespace trilume
