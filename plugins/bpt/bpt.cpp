#include "bpt.h"

#include "shared/bpt.h"

namespace trilume {

graph::Need BptNode::needed(const graph::SceneFacts& facts, const ParamSet& params) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (params.getChoice("bpt.when") == "casters" && facts.specularCasters == 0)
        return graph::Need::no("no specular casters: pathtrace is cheaper");
    return graph::Need::yes();
}

void BptNode::declare(graph::Builder& builder) {
    reservoirs_ = builder.findPlane("restir_di.reservoirs");
    if (reservoirs_) builder.read(reservoirs_);
    direct_ = {};
    if (!builder.findPlane("restir_di.direct")) {
        builder.owns(graph::PathClass::Direct);
        direct_ = builder.createPlane("bpt.direct", sizeof(glm::vec3));
    }
    builder.owns(graph::PathClass::Caustic);
    builder.owns(graph::PathClass::Indirect);
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    caustic_ = builder.createPlane("bpt.caustic", sizeof(glm::vec3));
    indirect_ = builder.createPlane("bpt.indirect", sizeof(glm::vec3));
    const auto perPixel = static_cast<size_t>(builder.params().getInt("bpt.maxLightVertices"));
    vertices_ =
        builder.createBuffer("bpt.vertices", sizeof(shared::BptVertex) * perPixel * builder.width() * builder.height());
    vertexCounts_ = builder.createPlane("bpt.vertexCounts", sizeof(uint32_t));
    splats_ = builder.createPlane("bpt.splats", shared::kBptSplatWords * sizeof(uint32_t));
}

void BptNode::execute(graph::FrameContext& context) {
    const auto& resources = context.resources;
    shared::BptPush push{};
    push.frame = context.frame;
    push.points = resources.address(points_);
    push.reservoirs = resources.address(reservoirs_);
    push.direct = resources.address(direct_);
    push.caustic = resources.address(caustic_);
    push.indirect = resources.address(indirect_);
    push.vertices = resources.address(vertices_);
    push.vertexCounts = resources.address(vertexCounts_);
    push.splats = resources.address(splats_);
    push.maxVertices = static_cast<uint32_t>(context.params.getInt("bpt.maxLightVertices"));
    push.maxDepth = static_cast<uint32_t>(context.params.getInt("bpt.maxDepth"));
    push.rouletteDepth = static_cast<uint32_t>(context.params.getInt("bpt.rouletteDepth"));
    push.powerShare = static_cast<float>(context.params.getFloat("bpt.powerShare"));
    const auto flag = [](bool on) { return std::string(on ? "1" : "0"); };
    std::vector<std::pair<std::string, std::string>> defines{
        {"TL_BPT_POWER", flag(context.params.getChoice("bpt.heuristic") == "power")},
        {"TL_BPT_DIRECT", flag(static_cast<bool>(direct_))},
        {"TL_BPT_RESERVOIRS", flag(static_cast<bool>(reservoirs_))}};
    if (reservoirs_)
        defines.emplace_back("TL_UNBIASED", flag(context.params.getChoice("restir_di.mode") == "unbiased"));
    for (const char* pass : {"passes/bpt/clear.comp", "passes/bpt/light.comp", "passes/bpt/eye.comp"}) {
        context.commands.dispatch(context.pipeline({pass, defines, {}}), push, context.width, context.height);
        context.commands.barrier();
    }
}

} // namespace trilume
