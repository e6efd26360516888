#include "caustics.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addParam({.name = "caustics.photons",
                       .defaultValue = int64_t{1 << 18},
                       .minimum = 64,
                       .maximum = 1 << 24,
                       .doc = "At most so many photons in a frame; fewer where the pixels that they light have enough.",
                       .cost = trilume::ParamCost::Structural,
                       .least = 1024});
    registry.addParam(
        {.name = "caustics.photonsPerPixel",
         .defaultValue = 0.125,
         .minimum = 1.0 / 1024,
         .maximum = 1024,
         .doc = "Keeps small pictures cheap: at most so many photons for each pixel, but no fewer than 1024.",
         .cost = trilume::ParamCost::Structural});
    registry.addParam({.name = "caustics.direct",
                       .defaultValue = std::string("splat"),
                       .choices = {"splat", "kernel"},
                       .doc = "What is seen directly: splat: each photon lights its pixel, without bias; kernel: it is "
                              "spread over gatherRadius, less noisy and blurred by that."});
    registry.addParam({.name = "caustics.historyFrames",
                       .defaultValue = int64_t{32},
                       .minimum = 1,
                       .maximum = 1024,
                       .unit = "frames",
                       .doc = "Frames that a single picture's caustics are a mean over, back to the last change of "
                              "lights or things; 1: none but its own."});
    registry.addParam({.name = "caustics.uniformShare",
                       .defaultValue = 0.2,
                       .minimum = 0.1,
                       .maximum = 1,
                       .doc = "Share of photons emitted as the light emits; the rest is aimed at mirrors and glass."});
    registry.addParam({.name = "caustics.settledShare",
                       .defaultValue = 0.125,
                       .minimum = 1.0 / 1024,
                       .maximum = 1,
                       .doc =
                           "Share of a frame's photons that a picture gets once it has stood still for 8 frames, where "
                           "pixels remember (caustics.historyFrames)."});
    registry.addParam({.name = "caustics.gatherRadius",
                       .defaultValue = 2.0,
                       .minimum = 0.1,
                       .maximum = 100,
                       .unit = "pixels",
                       .doc =
                           "Blurs caustics seen through mirrors and glass so far, in pixels, in the first frame of an "
                           "average; later ones blur less, down to nothing."});
    registry.addNode({"caustics", "caustics", [] { return std::make_unique<trilume::CausticsNode>(); }});
}

TL_PLUGIN("caustics", registerPlugin)
