#include "plugin/plugin_cpp.h"
#include "raytrace.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addNode({"raytrace", "raytrace", [] { return std::make_unique<trilume::RaytraceNode>(); }});
}

TL_PLUGIN("raytrace", registerPlugin)
