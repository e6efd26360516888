#include "cook_command.h"

#include "core/clock.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "frame_spec.h"
#include "plugin/registry.h"
#include "render/prebuilt_bvh.h"
#include "scene/snapshot.h"

#include <fmt/core.h>

#include <algorithm>

namespace trilume::cli {
namespace {

std::string counted(size_t count, std::string_view what, std::string_view plural = "s") {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : plural);
}

} // namespace

CLI::App* addCookCommand(CLI::App& app, CookArguments& a) {
    CLI::App* c = app.add_subcommand("cook", "Bake a stage into one file that loads at once and needs no plugin");
    c->add_option("STAGE", a.stage, ".usda .usdc .usd .usdz .tlscene")->required()->option_text(" ");
    c->add_option("OUTPUT", a.output, ".tlscene")->required()->option_text(" ");
    c->add_option(
         "-f,--frames", a.frames,
         "1:24, 1:24x2 or a comma list: bake these and what is sampled between; else all that the stage samples")
        ->option_text("SPEC");
    return c;
}

void runCook(const CookArguments& a) {
    const Stopwatch watch;
    if (lowerExtension(a.output) != ".tlscene")
        throw inputError("cooked scenes are .tlscene files", a.output, "name one that ends in .tlscene");
    const std::vector<double> frames = a.frames.empty() ? std::vector<double>{} : parseFrameSpec(a.frames);
    checkWritable(a.output);

    Registry registry;
    const std::unique_ptr<Scene> scene = registry.readScene(a.stage);
    if (!frames.empty()) scene->setTime(*std::min_element(frames.begin(), frames.end()));
    buildMeshBvhs(*scene);
    const SnapshotSummary s = writeSnapshot(*scene, a.output, frames);
    fmt::print("{}: {:.2f} MB: {} of {}, {}, {}, {}, {}, {} of {}, {:.2f} s\n", a.output, 1e-6 * double(s.bytes),
               counted(s.meshes, "mesh", "es"), counted(s.triangles, "triangle"), counted(s.instances, "instance"),
               counted(s.materials, "material"), counted(s.textures, "texture"), counted(s.lights, "light"),
               counted(s.tracks, "track"), counted(s.keys, "key"), 1e-3 * watch.ms());
}

} // namespace trilume::cli
