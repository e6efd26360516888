#include "raytrace.h"

#include "shared/passes.h"

namespace trilume {

graph::Need RaytraceNode::needed(const graph::SceneFacts& facts, const ParamSet& /*params*/) const {
    return facts.lights == 0 ? graph::Need::no("no lights") : graph::Need::yes();
}

void RaytraceNode::declare(graph::Builder& builder) {
    builder.owns(graph::PathClass::Direct);
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    direct_ = builder.createPlane("raytrace.direct", sizeof(glm::vec3));
}

void RaytraceNode::execute(graph::FrameContext& context) {
    shared::RaytracePush push{};
    push.frame = context.frame;
    push.points = context.resources.address(points_);
    push.direct = context.resources.address(direct_);
    context.commands.dispatch(context.pipeline({"passes/raytrace/raytrace.comp", {}, {}}), push, context.width,
                              context.height);
}

} // namespace trilume
