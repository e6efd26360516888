#include "render_command.h"

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <map>
#include <set>

namespace trilume::cli {
namespace {

/// One of a few words; help lists them.
template<class Enum>
CLI::Option* addChoice(CLI::App& app, const std::string& names, Enum& value, std::map<std::string, Enum> words,
                       const std::string& doc) {
    std::string list;
    std::set<std::string> known;
    for (const auto& [word, unused] : words) {
        list += (list.empty() ? "" : "|") + word;
        known.insert(word);
    }
    const auto set = [&value, words](const std::string& word) { value = words.at(word); };
    return app.add_option_function<std::string>(names, set, doc)->check(CLI::IsMember(known))->option_text(list);
}

/// From `least` to `most`; CLI::Range lets NaN through.
CLI::Validator numberWithin(double least, double most) {
    return {[=](std::string& text) {
                double number = 0;
                const bool good = CLI::detail::lexical_cast(text, number) && number >= least && number <= most;
                return good ? "" : fmt::format("{} is not a number from {:g} to {:g}", text, least, most);
            },
            ""};
}

} // namespace

CLI::App* addRenderCommand(CLI::App& app, RenderArguments& a) {
    CLI::App* c = app.add_subcommand("render", "Render a stage to images");
    c->add_option("STAGE", a.stage, ".usda .usdc .usd .usdz, or .tlscene of `trilume cook`")
        ->required()
        ->option_text(" ");
    c->add_option("OUTPUT", a.output,
                  ".exr .hdr .pfm (linear Rec. 709), .png .jpg (tone-mapped sRGB); #### is the frame")
        ->required()
        ->option_text(" ");

    const std::string what = "What to render";
    c->add_option("--camera", a.camera,
                  "camera by prim path or name; else the only one, else the render settings', else "
                  "one that frames the bounds")
        ->option_text("PATH")
        ->group(what);
    c->add_option("-f,--frames", a.frames, "1, 1:24, 1:24x2 or a comma list; else the stage's start")
        ->option_text("SPEC")
        ->group(what);
    const CLI::Range pixels(1, 32768);
    c->add_option("--imageWidth", a.width, "pixels; a missing one follows the camera's aperture (960 wide)")
        ->check(pixels)
        ->option_text("W")
        ->group(what);
    c->add_option("--imageHeight", a.height, "pixels")->check(pixels)->option_text("H")->group(what);
    addChoice<std::string>(*c, "--default-light", a.defaultLight, {{"auto", "auto"}, {"off", "off"}},
                           "auto: a stage without a light gets a dome of radiance 1")
        ->group(what);

    const std::string how = "How";
    c->add_option("-t,--technique", a.technique, "see `trilume info`")->option_text("NAME")->group(how);
    auto* spp = c->add_option("--spp", a.spp, "frames of the technique averaged into each output frame (1)")
                    ->check(CLI::Range(1u, 100'000'000u))
                    ->option_text("N")
                    ->group(how);
    c->add_option("--time", a.seconds, "in place of --spp: seconds to average for, per output frame")
        ->check(numberWithin(1e-6, 1e9))
        ->option_text("SECONDS")
        ->excludes(spp)
        ->group(how);
    c->add_option("--warmup", a.warmup, "frames rendered first and not averaged (0)")->option_text("N")->group(how);
    c->add_option("--target-ms", a.targetMs,
                  "hold frames of a sequence within this time by fewer probe rays, photons and light candidates: more "
                  "noise, and pictures depend on the machine's speed")
        ->check(numberWithin(1e-3, 1e6))
        ->option_text("MS")
        ->group(how);
    c->add_option("--seed", a.seed, "of the random numbers (0)")->option_text("N")->group(how);
    // One value per occurrence: what follows may be STAGE.
    const auto repeatable = [&](const char* name, std::vector<std::string>& values, const char* text, const char* doc) {
        return c->add_option(name, values, doc)->option_text(text)->allow_extra_args(false)->group(how);
    };
    repeatable("--set", a.sets, "NODE.PARAM=VALUE", "any parameter of `trilume info`; repeatable");
    repeatable("--enable", a.enabled, "NODE", "repeatable");
    repeatable("--disable", a.disabled, "NODE", "repeatable");
    addChoice<std::string>(
        *c, "--denoise", a.denoise, {{"off", "off"}, {"temporal", "temporal"}, {"oidn", "oidn"}},
        "temporal: over frames and surfaces; oidn: the finished picture, by Open Image Denoise (off for "
        "reference techniques, several --spp and --time; else temporal)")
        ->group(how);
    addChoice<gpu::Tracer>(
        *c, "--tracer", a.tracer,
        {{"auto", gpu::Tracer::Auto}, {"compute", gpu::Tracer::Compute}, {"query", gpu::Tracer::Query}},
        "own BVH, or the driver's ray queries")
        ->group(how);
    c->add_option("--device", a.device, "auto: discrete, integrated, virtual, CPU")
        ->option_text("auto|INDEX|NAME")
        ->group(how);

    const std::string outputs = "Outputs";
    repeatable("--aov", a.aovs, "NAME=FILE",
               "color direct indirect caustic emission albedo normal depth motion variance; repeatable")
        ->group(outputs);
    c->add_option("--exposure", a.display.exposure, "display outputs only (0)")
        ->check(numberWithin(-100, 100))
        ->option_text("EV")
        ->group(outputs);
    addChoice<ToneMap>(*c, "--tonemap", a.display.toneMap,
                       {{"none", ToneMap::None}, {"aces", ToneMap::Aces}, {"agx", ToneMap::Agx}},
                       "display outputs only (agx)")
        ->group(outputs);
    c->add_option("--stats", a.statsFile, "timings and counts as JSON")->option_text("FILE")->group(outputs);
    c->add_flag("--resume", a.resume, "skip frames whose output is already complete")->group(outputs);
    addChoice<ProgressMode>(*c, "--progress", a.progress,
                            {{"auto", ProgressMode::Auto}, {"on", ProgressMode::On}, {"off", ProgressMode::Off}},
                            "a bar with the time left; auto: on a terminal")
        ->group(outputs);
    return c;
}

} // namespace trilume::cli
