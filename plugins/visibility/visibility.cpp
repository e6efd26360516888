#include "visibility.h"

#include "graph/aov.h"
#include "graph/denoised.h"
#include "shared/visibility.h"

namespace trilume {

namespace {

bool wantsGuides(const ParamSet& params) {
    const int64_t wanted = params.getInt(graph::kAovParam);
    for (size_t i = 0; i < graph::kAovs.size(); ++i)
        if (graph::kAovs[i].guide && (wanted >> i & 1) != 0) return true;
    return false;
}

} // namespace

void VisibilityNode::declare(graph::Builder& builder) {
    builder.owns(graph::PathClass::Emission);
    points_ = builder.historyPlane("visibility.points", sizeof(shared::VisiblePoint)).current;
    emission_ = builder.createPlane("visibility.emission", sizeof(glm::vec3));
    emitters_ = {};
    if (builder.facts().lights > 0 && graph::denoised(builder.params()))
        emitters_ = builder.createPlane("visibility.emitters", sizeof(shared::VisibleEmitter));
    albedo_ = normal_ = depth_ = motion_ = {};
    if (!wantsGuides(builder.params())) return;
    albedo_ = builder.createPlane("visibility.albedo", sizeof(glm::vec3));
    normal_ = builder.createPlane("visibility.normal", sizeof(glm::vec3));
    depth_ = builder.createPlane("visibility.depth", sizeof(float));
    motion_ = builder.createPlane("visibility.motion", sizeof(glm::vec2));
}

void VisibilityNode::execute(graph::FrameContext& context) {
    shared::VisibilityPush push{};
    push.frame = context.frame;
    push.points = context.resources.address(points_);
    push.emission = context.resources.address(emission_);
    push.maxBounces = static_cast<uint32_t>(context.params.getInt("visibility.maxBounces"));
    if (emitters_) {
        push.flags |= shared::kVisibilityEmitters;
        push.emitters = context.resources.address(emitters_);
    }
    if (albedo_) {
        push.flags |= shared::kVisibilityGuides;
        push.albedo = context.resources.address(albedo_);
        push.normal = context.resources.address(normal_);
        push.depth = context.resources.address(depth_);
        push.motion = context.resources.address(motion_);
    }
    context.commands.dispatch(context.pipeline({"passes/visibility/visibility.comp", {}, {}}), push, context.width,
                              context.height);
}

} // namespace trilume
