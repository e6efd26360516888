#include "plugin/plugin_cpp.h"
#include "post.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addParam({.name = "post.exposure",
                       .defaultValue = 0.0,
                       .minimum = -32,
                       .maximum = 32,
                       .unit = "EV",
                       .doc = "Brightness of the displayed picture, in stops."});
    registry.addParam({.name = "post.tonemap",
                       .defaultValue = std::string("agx"),
                       .choices = {"none", "aces", "agx"},
                       .doc = "How scene-linear values fit the display: none cuts off at 1."});
    registry.addNode({"post", "post", [] { return std::make_unique<trilume::PostNode>(); }});
}

TL_PLUGIN("post", registerPlugin)
