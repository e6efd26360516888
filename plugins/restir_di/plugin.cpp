#include "plugin/plugin_cpp.h"
#include "restir_di.h"

static void registerPlugin(trilume::Registry& registry) {
    using trilume::ParamCost;
    registry.addParam({.name = "restir_di.mode",
                       .defaultValue = std::string("unbiased"),
                       .choices = {"unbiased", "fast"},
                       .doc =
                           "unbiased: visibility is in every target function; fast: one shadow ray a pixel, too dark "
                           "near the borders of shadows.",
                       .cost = ParamCost::Specialization,
                       .resetsHistory = true});
    registry.addParam({.name = "restir_di.reuse",
                       .defaultValue = std::string("auto"),
                       .choices = {"auto", "off", "temporal", "spatiotemporal"},
                       .doc =
                           "Whose reservoirs a pixel draws on: none, last frame's, or its neighbours' as well; auto: "
                           "none with 32 lights or fewer and no dome, else last frame's, and in an average only "
                           "in its first 16 frames, as reuse couples frames.",
                       .cost = ParamCost::Structural,
                       .resetsHistory = true});
    registry.addParam({.name = "restir_di.lightCandidates",
                       .defaultValue = int64_t{32},
                       .minimum = 1,
                       .maximum = 1024,
                       .doc =
                           "Light samples resampled into one for each pixel and frame, no more than there are lights "
                           "(a dome counts as eight); one where there are no more than two lights.",
                       .least = 4});
    registry.addParam({.name = "restir_di.learnedCandidates",
                       .defaultValue = int64_t{3},
                       .minimum = 2,
                       .maximum = 64,
                       .doc =
                           "Light samples in place of those above where the lights that a tile of pixels has learned "
                           "bring it all its light; one of them, in the mean, goes to all lights by power."});
    registry.addParam(
        {.name = "restir_di.bsdfCandidates",
         .defaultValue = int64_t{1},
         .minimum = 0,
         .maximum = 64,
         .doc = "BSDF samples, a ray each, resampled together with the light samples on glossy surfaces."});
    registry.addParam({.name = "restir_di.bsdfRoughness",
                       .defaultValue = 0.5,
                       .minimum = 0,
                       .maximum = 1,
                       .doc = "Perceptual roughness up to which a surface takes BSDF samples; 1: all surfaces."});
    registry.addParam({.name = "restir_di.maxHistory",
                       .defaultValue = int64_t{20},
                       .minimum = 0,
                       .maximum = 1000,
                       .doc =
                           "Confidence in last frame's reservoirs, in frames: more is less noise and more correlation "
                           "from frame to frame."});
    registry.addParam({.name = "restir_di.spatialNeighbors",
                       .defaultValue = int64_t{2},
                       .minimum = 0,
                       .maximum = 8,
                       .doc = "Pixels around whose reservoirs a pixel draws on; two rays each where unbiased."});
    registry.addParam({.name = "restir_di.radius",
                       .defaultValue = 16.0,
                       .minimum = 1,
                       .maximum = 256,
                       .unit = "pixels",
                       .doc = "How far away those pixels may be."});
    registry.addNode({"restir_di", "restir_di", [] { return std::make_unique<trilume::RestirDiNode>(); }});
}

TL_PLUGIN("restir_di", registerPlugin)
