#pragma once

#include "outputs.h"
#include "progress.h"

#include <CLI/App.hpp>

#include <optional>
#include <string>
#include <vector>

namespace trilume::cli {

/// The options of `trilume render`, as given.
struct RenderArguments {
    std::string stage, output;
    std::string camera;
    std::string frames;
    uint32_t width = 0, height = 0; ///< 0: not given
    std::string technique;          ///< empty: the default one
    uint32_t spp = 1;
    double seconds = 0;
    uint32_t warmup = 0;
    double targetMs = 0; ///< 0: none
    uint64_t seed = 0;
    std::vector<std::string> sets, enabled, disabled;
    gpu::Tracer tracer = gpu::Tracer::Auto;
    std::string device = "auto";
    std::string defaultLight = "auto";
    std::vector<std::string> aovs;
    std::string denoise; ///< empty: as the technique and the number of samples suggest
    DisplayOptions display;
    std::string statsFile;
    bool resume = false;
    ProgressMode progress = ProgressMode::Auto;
};

/// Adds `render` to the command; its options are written to `arguments`.
CLI::App* addRenderCommand(CLI::App& app, RenderArguments& arguments);

/// Renders and writes what the arguments ask for. Throws Error; what was written before then stays.
void runRender(const RenderArguments& arguments);

} // namespace trilume::cli
