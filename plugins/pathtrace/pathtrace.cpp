#include "pathtrace.h"

#include "shared/passes.h"

namespace trilume {

graph::Need PathtraceNode::needed(const graph::SceneFacts& facts, const ParamSet& params) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (params.getChoice("pathtrace.when") == "noCasters" && facts.specularCasters > 0)
        return graph::Need::no("specular casters: bpt finds their caustics");
    return graph::Need::yes();
}

void PathtraceNode::declare(graph::Builder& builder) {
    for (const auto pathClass : {graph::PathClass::Direct, graph::PathClass::Caustic, graph::PathClass::Indirect})
        builder.owns(pathClass);
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    direct_ = builder.createPlane("pathtrace.direct", sizeof(glm::vec3));
    caustic_ = builder.createPlane("pathtrace.caustic", sizeof(glm::vec3));
    indirect_ = builder.createPlane("pathtrace.indirect", sizeof(glm::vec3));
}

void PathtraceNode::execute(graph::FrameContext& context) {
    shared::PathtracePush push{};
    push.frame = context.frame;
    push.points = context.resources.address(points_);
    push.direct = context.resources.address(direct_);
    push.caustic = context.resources.address(caustic_);
    push.indirect = context.resources.address(indirect_);
    push.maxDepth = static_cast<uint32_t>(context.params.getInt("pathtrace.maxDepth"));
    push.rouletteDepth = static_cast<uint32_t>(context.params.getInt("pathtrace.rouletteDepth"));
    const char* nee = context.params.getBool("pathtrace.nee") ? "1" : "0";
    context.commands.dispatch(context.pipeline({"passes/pathtrace/pathtrace.comp", {{"TL_NEE", nee}}, {}}), push,
                              context.width, context.height);
}

} // namespace trilume
