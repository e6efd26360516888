#include "denoise.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addParam({.name = "denoise.mode",
                       .defaultValue = std::string("off"),
                       .choices = {"off", "temporal"},
                       .doc =
                           "temporal: each signal is accumulated over frames and filtered over surfaces, which blurs "
                           "where noise hides the detail.",
                       .cost = trilume::ParamCost::Structural});
    registry.addParam(
        {.name = "denoise.maxFrames",
         .defaultValue = int64_t{64},
         .minimum = 1,
         .maximum = 65536,
         .unit = "frames",
         .doc = "Longest history; more is smoother and slower to follow changes too small to be noticed."});
    registry.addParam({.name = "denoise.levels",
                       .defaultValue = int64_t{3},
                       .minimum = 0,
                       .maximum = 6,
                       .doc = "Levels of the spatial filter, each three times as wide as the one before; 0: none, no "
                              "blur.",
                       .least = 1});
    registry.addParam({.name = "denoise.sigma",
                       .defaultValue = 2.0,
                       .minimum = 0,
                       .maximum = 100,
                       .unit = "standard deviations",
                       .doc = "Difference in luminance at which neighbours cease to be mixed; more blurs more."});
    registry.addParam({.name = "denoise.changeSigma",
                       .defaultValue = 1.0,
                       .minimum = 0,
                       .maximum = 1000,
                       .unit = "standard deviations",
                       .doc =
                           "Difference between a frame and history from which on history is shortened after a change "
                           "of the scene; less ghosts less and is noisier."});
    registry.addNode({"denoise", "denoise", [] { return std::make_unique<trilume::DenoiseNode>(); }});
}

TL_PLUGIN("denoise", registerPlugin)
