#include "composite.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addNode({"composite", "composite", [] { return std::make_unique<trilume::CompositeNode>(); }});
}

TL_PLUGIN("composite", registerPlugin)
