#include "plugin/plugin_cpp.h"
#include "visibility.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addParam({.name = "visibility.maxBounces",
                       .defaultValue = int64_t{64},
                       .minimum = 0,
                       .maximum = 1024,
                       .doc = "Mirrors and refractions that a camera ray may pass; light beyond them is lost.",
                       .resetsHistory = true});
    registry.addNode({"visibility", "visibility", [] { return std::make_unique<trilume::VisibilityNode>(); }});
}

TL_PLUGIN("visibility", registerPlugin)
