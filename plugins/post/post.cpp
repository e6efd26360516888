#include "post.h"

#include "shared/display.h"
#include "shared/passes.h"

#include <cmath>

namespace trilume {

namespace {

uint32_t tonemapOf(const std::string& name) {
    if (name == "aces") return shared::kTonemapAces;
    return name == "agx" ? shared::kTonemapAgx : shared::kTonemapNone;
}

} // namespace

void PostNode::declare(graph::Builder& builder) {
    sums_ = builder.findPlane("composite.sums");
    builder.read(sums_);
    display_ = builder.createPlane("post.display", sizeof(uint32_t));
}

void PostNode::execute(graph::FrameContext& context) {
    shared::PostPush push{};
    push.frame = context.frame;
    push.sums = context.resources.address(sums_);
    push.display = context.resources.address(display_);
    push.exposure = std::exp2(static_cast<float>(context.params.getFloat("post.exposure")));
    push.tonemap = tonemapOf(context.params.getChoice("post.tonemap"));
    push.frames = context.sampleIndex + 1;
    context.commands.dispatch(context.pipeline({"passes/post/post.comp", {}, {}}), push, context.width, context.height);
}

} // namespace trilume
