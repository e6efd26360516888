// A long run in one process, for `trilume bench stability`: a stage's time goes round and round while nodes, rows,
// techniques, sizes and the stage itself are switched, as in an editor. JSON on standard output.

#include "core/error.h"
#include "core/version.h"
#include "render/renderer.h"

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace trilume {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
    std::string stage, device = "auto";
    uint32_t frames = 1000, width = 32, height = 18;
    uint64_t seed = 0;
    gpu::Tracer tracer = gpu::Tracer::Auto;
    std::vector<std::string> sets;
    bool leak = false;
};

/// What changes kernels, histories or the graph, each with a value that is not its own.
constexpr std::pair<const char*, const char*> kRows[] = {{"denoise.mode", "temporal"},
                                                         {"ddgi.gather", "final"},
                                                         {"sampler.sequence", "independent"},
                                                         {"restir_di.reuse", "spatiotemporal"},
                                                         {"caustics.direct", "kernel"}};
constexpr uint32_t kSteadyFrames = 8, kSwitchedFrames = 2;

size_t residentBytes() {
    size_t all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

/// Part of a loop; `enter` and `leave` switch something there and back.
struct Phase {
    std::string name;
    uint32_t frames = kSwitchedFrames;
    std::function<void()> enter, leave;
    std::vector<double> means; ///< by loop
};

class Soak {
public:
    explicit Soak(const Arguments& arguments);
    Json run();

private:
    std::unique_ptr<View> openView(Scene& scene, uint32_t width, uint32_t height);
    void addPhases();
    void loop();
    /// Mean radiance, clipped to 1: the few pixels that show a lamp would outweigh all others.
    double render(View& view, ImageData& picture);
    void followTime();

    const Arguments& a_;
    Engine engine_;
    const Technique& technique_;
    std::unique_ptr<Scene> scene_;
    std::unique_ptr<View> main_, resized_;
    View* view_ = nullptr; ///< the one that a phase renders
    std::vector<Phase> phases_;
    uint32_t loopFrames_ = 0, frame_ = 0; ///< in a loop; of this loop
    uint64_t rendered_ = 0, nonfinite_ = 0, changedAfterReload_ = 0;
    std::vector<ImageData> firstAfterReload_;
    std::vector<size_t> memoryBytes_, residentBytes_; ///< by loop
    std::vector<std::unique_ptr<View>> leaked_;
};

Soak::Soak(const Arguments& arguments)
    : a_(arguments), engine_({.device = {.device = a_.device}, .tracer = a_.tracer}),
      technique_(engine_.registry().defaultTechnique()), scene_(engine_.registry().readScene(a_.stage)),
      main_(openView(*scene_, a_.width, a_.height)), view_(main_.get()) {
    addPhases();
    for (const Phase& phase : phases_) loopFrames_ += phase.frames;
}

std::unique_ptr<View> Soak::openView(Scene& scene, uint32_t width, uint32_t height) {
    auto view = std::make_unique<View>(engine_, scene, width, height, "");
    for (const std::string& text : a_.sets) {
        const size_t equals = std::min(text.find('='), text.size());
        view->params().set(text.substr(0, equals), text.substr(std::min(equals + 1, text.size())));
    }
    view->setSeed(a_.seed);
    return view;
}

void Soak::addPhases() {
    phases_.push_back({.name = "steady", .frames = kSteadyFrames});
    for (const std::string& node : technique_.nodes)
        if (node != technique_.nodes.front() && node != technique_.nodes.back())
            phases_.push_back({.name = "without " + node,
                               .enter = [this, node] { main_->setNodeEnabled(node, false); },
                               .leave = [this, node] { main_->setNodeEnabled(node, true); }});
    for (const auto& [row, value] : kRows)
        phases_.push_back(
            {.name = fmt::format("{}={}", row, value),
             .enter = [this, row = row, value = value] { main_->params().set(row, value); },
             .leave = [this, row = row, own = main_->params().getText(row)] { main_->params().set(row, own); }});
    for (const Technique& technique : engine_.registry().techniques())
        phases_.push_back({.name = technique.name,
                           .enter = [this, name = technique.name] { main_->setTechnique(name); },
                           .leave = [this] { main_->setTechnique(technique_.name); }});
    phases_.push_back({.name = "steady again", .frames = kSteadyFrames});
    phases_.push_back({.name = "resized",
                       .enter =
                           [this] {
                               resized_ = openView(*scene_, a_.width * 3 / 2, a_.height * 3 / 2);
                               view_ = resized_.get();
                           },
                       .leave =
                           [this] {
                               if (a_.leak) leaked_.push_back(std::move(resized_));
                               resized_.reset();
                               view_ = main_.get();
                           }});
}

double Soak::render(View& view, ImageData& picture) {
    picture = view.render({});
    ++rendered_;
    nonfinite_ += view.stats().nonfinite;
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < picture.pixels.size(); ++i) {
        if (i % picture.channels == 3) continue;
        const float x = picture.pixels[i];
        if (!std::isfinite(x)) {
            ++nonfinite_;
            continue;
        }
        sum += std::clamp(x, 0.0f, 1.0f);
        ++count;
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

void Soak::followTime() {
    const double start = scene_->startTime.value_or(0), end = scene_->endTime.value_or(start);
    scene_->setTime(start + (end - start) * frame_++ / loopFrames_);
}

void Soak::loop() {
    ImageData picture;
    frame_ = 0;
    for (Phase& phase : phases_) {
        if (phase.enter) phase.enter();
        double sum = 0;
        for (uint32_t i = 0; i < phase.frames; ++i) {
            followTime();
            sum += render(*view_, picture);
        }
        phase.means.push_back(sum / phase.frames);
        if (phase.leave) phase.leave();
    }

    // A stage that was just read gives the pictures that it gave the first time, whatever the engine did since.
    const std::unique_ptr<Scene> scene = engine_.registry().readScene(a_.stage);
    const std::unique_ptr<View> view = openView(*scene, a_.width, a_.height);
    for (uint32_t i = 0; i < kSwitchedFrames; ++i) {
        render(*view, picture);
        if (firstAfterReload_.size() <= i) firstAfterReload_.push_back(picture);
        if (picture.pixels != firstAfterReload_[i].pixels) ++changedAfterReload_;
    }
    memoryBytes_.push_back(engine_.device().memoryInUse());
    residentBytes_.push_back(residentBytes());
}

Json Soak::run() {
    const uint32_t loops = std::max(1u, a_.frames / (loopFrames_ + kSwitchedFrames));
    for (uint32_t i = 0; i < loops; ++i) loop();
    Json phases = Json::array();
    for (const Phase& phase : phases_)
        phases.push_back({{"name", phase.name}, {"frames", phase.frames}, {"means", phase.means}});
    return {{"version", TRILUME_VERSION},   {"device", engine_.device().info().name},
            {"frames", rendered_},          {"phases", phases},
            {"nonfinite", nonfinite_},      {"changed_after_reload", changedAfterReload_},
            {"memory_bytes", memoryBytes_}, {"resident_bytes", residentBytes_}};
}

int run(int argc, char** argv) {
    Arguments a;
    CLI::App app("Renders a stage's time over and over while things are switched", "bench_soak");
    app.add_option("stage", a.stage)->required();
    app.add_option("--frames", a.frames, "about so many, in whole loops");
    app.add_option("--width", a.width);
    app.add_option("--height", a.height);
    app.add_option("--seed", a.seed);
    app.add_option("--device", a.device);
    const std::map<std::string, gpu::Tracer> tracers{
        {"auto", gpu::Tracer::Auto}, {"compute", gpu::Tracer::Compute}, {"query", gpu::Tracer::Query}};
    app.add_option("--tracer", a.tracer)->transform(CLI::CheckedTransformer(tracers));
    app.add_option("--set", a.sets, "NODE.PARAM=VALUE");
    app.add_flag("--leak", a.leak, "keep the views of other sizes, so that a test sees memory grow");
    CLI11_PARSE(app, argc, argv);
    fmt::print("{}\n", Soak(a).run().dump());
    return 0;
}

int fail(const Error& error) {
    fmt::print(stderr, "bench_soak: error: {}\n", error.what());
    return static_cast<int>(error.fault());
}

} // namespace
} // namespace trilume

int main(int argc, char** argv) {
    using namespace trilume;
    try {
        return run(argc, argv);
    } catch (const Error& error) {
        return fail(error);
    } catch (const std::exception& error) {
        return fail(runError("unexpected failure", error.what(), "please report this"));
    }
}
