#include "pathtrace.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    using trilume::ParamCost;
    registry.addParam({.name = "pathtrace.nee",
                       .defaultValue = true,
                       .doc = "Next-event estimation with multiple importance sampling; off: lights are found by BSDF "
                              "samples alone, as in the paper (unbiased, noisier; distant lights of angle 0 are lost).",
                       .cost = ParamCost::Specialization,
                       .resetsHistory = true});
    registry.addParam({.name = "pathtrace.maxDepth",
                       .defaultValue = int64_t{1024},
                       .minimum = 1,
                       .maximum = 65536,
                       .doc = "Surfaces from the visible point on; light beyond them is lost (none in effect at 1024).",
                       .resetsHistory = true});
    registry.addParam({.name = "pathtrace.rouletteDepth",
                       .defaultValue = int64_t{3},
                       .minimum = 0,
                       .maximum = 65536,
                       .doc = "Surfaces before Russian roulette sets in; trades time for noise, without bias."});
    registry.addParam(
        {.name = "pathtrace.when",
         .defaultValue = std::string("always"),
         .choices = {"always", "noCasters"},
         .doc = "Whether to run in scenes with specular casters, which technique reference leaves to bpt.",
         .cost = ParamCost::Structural,
         .resetsHistory = true});
    registry.addNode({"pathtrace", "pathtrace", [] { return std::make_unique<trilume::PathtraceNode>(); }});
}

TL_PLUGIN("pathtrace", registerPlugin)
