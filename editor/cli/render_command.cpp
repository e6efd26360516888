#include "render_command.h"

#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "interruption.h"
#include "stats_json.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace trilume::cli {
namespace {

constexpr uint32_t kDefaultWidth = 960;

/// off, temporal or oidn. Averages converge to the technique's expected picture, and a filter would only blur them.
std::string denoiserFor(const RenderArguments& a, const Technique& technique) {
    const bool temporal = std::find(technique.nodes.begin(), technique.nodes.end(), "denoise") != technique.nodes.end();
    if (a.denoise == "temporal" && !temporal)
        throw inputError("this technique has no node denoise", "--denoise temporal, " + technique.name,
                         "use --denoise oidn or off");
    if (!a.denoise.empty()) return a.denoise;
    return temporal && !technique.reference && a.spp == 1 && a.seconds == 0 ? "temporal" : "off";
}

/// The frames that were asked for; without a spec the stage's first, and 0 for a stage without a range.
std::vector<double> framesOf(const RenderArguments& a, const Scene& scene) {
    if (!a.frames.empty()) return parseFrameSpec(a.frames);
    return {scene.startTime.value_or(0)};
}

/// Without a spec the scene stays at the time that its reader has chosen.
void setTime(const RenderArguments& a, Scene& scene, const std::vector<double>& frames) {
    if (!a.frames.empty() && !frames.empty()) scene.setTime(frames.front());
    if (Interruption::flag()) throw runError("interrupted", scene.path, "nothing was written");
}

void lightDarkStage(const RenderArguments& a, Scene& scene) {
    scene.updateTransforms();
    if (a.defaultLight == "off" || hasLight(scene)) return;
    addDefaultLight(scene);
    log::warning("no light in {}: a dome of radiance 1 was added; --default-light off leaves it dark", scene.path);
}

struct Size {
    uint32_t width, height;
};

Size pictureSize(const RenderArguments& a, Scene& scene) {
    const Camera& camera = *scene.world.find<Camera>(chooseCamera(scene, a.camera));
    Size size{a.width, a.height};
    if (size.width == 0 && size.height == 0) size = {scene.renderSettings.width, scene.renderSettings.height};
    if (size.width == 0 && size.height == 0) size.width = kDefaultWidth;
    double ratio = camera.horizontalAperture / camera.verticalAperture;
    if (!(ratio > 1e-4 && ratio < 1e4)) ratio = 1;
    const auto follow = [](double pixels) { return static_cast<uint32_t>(std::max(1l, std::lround(pixels))); };
    if (size.height == 0) size.height = follow(size.width / ratio);
    if (size.width == 0) size.width = follow(size.height * ratio);
    return size;
}

void configure(View& view, const RenderArguments& a, const Outputs& outputs, const std::string& technique,
               const std::string& denoiser) {
    view.setTechnique(technique);
    if (denoiser == "temporal") view.params().set("denoise.mode", "temporal");
    if (denoiser == "oidn") view.setImageFilter("oidn");
    for (const std::string& text : a.sets) {
        const size_t equals = text.find('=');
        if (equals == std::string::npos) throw inputError("bad parameter", "--set " + text, "write NODE.PARAM=VALUE");
        view.params().set(text.substr(0, equals), text.substr(equals + 1));
    }
    for (const std::string& node : a.enabled) view.setNodeEnabled(node, true);
    for (const std::string& node : a.disabled) view.setNodeEnabled(node, false);
    view.setAovs(outputs.aovNames());
    view.setTargetMs(a.targetMs);
}

/// Throws for an AOV that the compiled graph doesn't make, before the time to render is spent.
void checkAovs(View& view, const Outputs& outputs) {
    for (const std::string& name : outputs.aovNames()) (void)view.aov(name);
}

Error interruptedError(const RunStats& stats, const Outputs& outputs, double frame) {
    std::string hint = "nothing was written";
    if (!stats.frames.empty()) {
        const std::string first = frameText(stats.frames.front().frame), last = frameText(stats.frames.back().frame);
        hint =
            "this one was not written, " +
            (stats.frames.size() == 1 ? "frame " + first + " was"
                                      : fmt::format("{} frames from {} to {} were", stats.frames.size(), first, last)) +
            "; --resume goes on from here";
    }
    return runError("interrupted", outputs.picturePath(frame), hint);
}

/// Of the output frame's own: rendered alone, resumed or in a sequence it has the same noise, and another one than its
/// neighbours. The mixer is SplitMix64's (Steele, Lea, Flood 2014).
uint64_t seedOf(uint64_t seed, double frame) {
    uint64_t x = seed + 0x9e3779b97f4a7c15ull * std::bit_cast<uint64_t>(frame + 0.0); // -0 + 0 is 0.
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ x >> 27) * 0x94d049bb133111ebull;
    return x ^ x >> 31;
}

/// Renders frame after frame until done or interrupted; an interrupted frame is not written.
void renderFrames(const RenderArguments& a, Engine& engine, Scene& scene, View& view, const Outputs& outputs,
                  const std::vector<double>& frames, const Stopwatch& sinceStart, RunStats& stats) {
    Progress progress(a.progress, frames.size());
    for (size_t i = 0; i < frames.size(); ++i) {
        if (i > 0) scene.setTime(frames[i]);
        view.setSeed(seedOf(a.seed, frames[i]));
        const double before = sinceStart.ms();
        const ImageData picture = view.render({.spp = a.spp,
                                               .seconds = a.seconds,
                                               .warmup = i == 0 ? a.warmup : 0,
                                               .cancel = &Interruption::flag(),
                                               .progress = [&](double done) { progress.update(i, done); }});
        if (Interruption::flag()) throw interruptedError(stats, outputs, frames[i]);
        const FrameStats& s = view.stats();
        if (i == 0) stats.startup.firstFrameMs = before + s.ms / (s.spp + a.warmup);
        if (s.nonfinite > 0)
            log::warning("{}: {} samples were not finite: left out", outputs.picturePath(frames[i]), s.nonfinite);
        outputs.write(frames[i], engine.registry(), picture, view);
        stats.frames.push_back({frames[i], s});
    }
}

void writeStats(const std::string& path, const RunStats& stats) {
    if (path.empty()) return;
    const std::string text = statsJson(stats).dump(2) + "\n";
    writeFileAtomically(path, std::as_bytes(std::span(text)));
}

void printSummary(const RunStats& stats, const Outputs& outputs, size_t skipped, double totalMs) {
    double ms = 0;
    for (const RunStats::Frame& frame : stats.frames) ms += frame.stats.ms;
    const FrameStats& last = stats.frames.back().stats;
    const std::string count = stats.frames.size() > 1 ? fmt::format("{} frames of ", stats.frames.size()) : "";
    const std::string already = skipped > 0 ? fmt::format("; {} were complete already", skipped) : "";
    fmt::print("{}: {}{} x {}, {} averaged{}, {:.2f} s ({:.2f} s with start-up and writing){}\n",
               stats.frames.size() > 1 ? outputs.picturePattern() : outputs.picturePath(stats.frames.back().frame),
               count, stats.width, stats.height, last.spp, count.empty() ? "" : " each", 1e-3 * ms, 1e-3 * totalMs,
               already);
}

} // namespace

void runRender(const RenderArguments& a) {
    const Stopwatch sinceStart;
    const Interruption interruption;
    const Outputs outputs(a.output, a.aovs, a.display);
    if (!a.statsFile.empty()) checkWritable(a.statsFile);
    if (!a.frames.empty()) outputs.checkFor(parseFrameSpec(a.frames));

    Engine engine({.device = {.device = a.device}, .tracer = a.tracer});
    outputs.check(engine.registry());
    const Registry& registry = engine.registry();
    const Technique& technique = a.technique.empty() ? registry.defaultTechnique() : registry.technique(a.technique);
    const std::string denoiser = denoiserFor(a, technique);

    const Stopwatch loading;
    const std::unique_ptr<Scene> scene = engine.registry().readScene(a.stage);
    std::vector<double> frames = framesOf(a, *scene);
    outputs.checkFor(frames);
    const size_t asked = frames.size();
    if (a.resume) std::erase_if(frames, [&](double frame) { return outputs.complete(frame, engine.registry()); });
    setTime(a, *scene, frames);
    const Size size = pictureSize(a, *scene);
    RunStats stats{.device = engine.device().info(),
                   .tracer = engine.tracer(),
                   .technique = technique.name,
                   .stage = a.stage,
                   .width = size.width,
                   .height = size.height,
                   .startup = {.deviceMs = engine.deviceMs(), .loadMs = loading.ms()}};
    if (frames.empty()) {
        writeStats(a.statsFile, stats);
        fmt::print("{}: complete already\n", outputs.picturePattern());
        return;
    }
    lightDarkStage(a, *scene);
    View view(engine, *scene, size.width, size.height, a.camera);
    configure(view, a, outputs, technique.name, denoiser);
    stats.startup.pipelinesMs = view.prepare();
    stats.startup.pipelines = engine.pipelineCosts();
    checkAovs(view, outputs);
    try {
        renderFrames(a, engine, *scene, view, outputs, frames, sinceStart, stats);
    } catch (const Error&) {
        if (!stats.frames.empty()) writeStats(a.statsFile, stats);
        throw;
    }
    writeStats(a.statsFile, stats);
    printSummary(stats, outputs, asked - frames.size(), sinceStart.ms());
}

} // namespace trilume::cli
