#include "bpt.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    using trilume::ParamCost;
    registry.addParam({.name = "bpt.heuristic",
                       .defaultValue = std::string("power"),
                       .choices = {"power", "balance"},
                       .doc = "How strategies are weighed: power (exponent 2) or balance; both without bias.",
                       .cost = ParamCost::Specialization});
    registry.addParam({.name = "bpt.maxLightVertices",
                       .defaultValue = int64_t{4},
                       .minimum = 1,
                       .maximum = 64,
                       .doc = "Vertices of each pixel's light subpath kept for connections, 48 bytes each; of a longer "
                              "one a random subset stands for all, without bias.",
                       .cost = ParamCost::Structural});
    registry.addParam({.name = "bpt.maxDepth",
                       .defaultValue = int64_t{1024},
                       .minimum = 1,
                       .maximum = 65536,
                       .doc = "Surfaces of each subpath; light beyond them is lost (none in effect at 1024).",
                       .resetsHistory = true});
    registry.addParam({.name = "bpt.powerShare",
                       .defaultValue = 0.25,
                       .minimum = 0,
                       .maximum = 1,
                       .doc =
                           "Of light subpaths that start from restir_di's reservoirs: the share that starts by light "
                           "power instead. 0, as in the paper, loses the light of lamps that a pixel does not see."});
    registry.addParam({.name = "bpt.rouletteDepth",
                       .defaultValue = int64_t{3},
                       .minimum = 0,
                       .maximum = 65536,
                       .doc = "Surfaces before Russian roulette sets in; trades time for noise, without bias."});
    registry.addParam({.name = "bpt.when",
                       .defaultValue = std::string("always"),
                       .choices = {"always", "casters"},
                       .doc = "Whether to run in scenes without specular casters, which technique reference leaves to "
                              "pathtrace.",
                       .cost = ParamCost::Structural,
                       .resetsHistory = true});
    registry.addNode({"bpt", "bpt", [] { return std::make_unique<trilume::BptNode>(); }});
}

TL_PLUGIN("bpt", registerPlugin)
