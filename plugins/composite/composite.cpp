#include "composite.h"

#include "core/error.h"
#include "graph/aov.h"
#include "shared/passes.h"

#include <string>

namespace trilume {

namespace {

void checkCount(const std::vector<graph::Plane>& planes) {
    if (planes.size() > shared::kCompositeSignals)
        throw runError("too many signals", "node composite", "let nodes of one path class share a plane");
}

} // namespace

void CompositeNode::declare(graph::Builder& builder) {
    signals_.clear();
    aovs_.clear();
    for (const char* suffix : {".emission", ".direct", ".caustic", ".indirect"})
        for (const graph::Plane plane : builder.findPlanes(suffix)) {
            builder.read(plane);
            signals_.push_back(plane);
        }
    checkCount(signals_);
    color_ = builder.createPlane("composite.color", sizeof(glm::vec3));
    sums_ = builder.historyPlane("composite.sums", sizeof(shared::PixelSums));

    const int64_t wanted = builder.params().getInt(graph::kAovParam);
    for (size_t i = 0; i < graph::kAovs.size(); ++i) {
        if ((wanted >> i & 1) == 0) continue;
        const graph::Aov& aov = graph::kAovs[i];
        const std::vector<graph::Plane> values = builder.findPlanes(aov.suffix);
        if (values.empty()) continue;
        checkCount(values);
        for (const graph::Plane plane : values) builder.read(plane);
        const std::string name = "composite.aov." + std::string(aov.name);
        aovs_.push_back({values, builder.historyPlane(name, aov.channels * sizeof(float)), aov.channels});
    }
    builder.sideEffect();
}

void CompositeNode::execute(graph::FrameContext& context) {
    const auto& resources = context.resources;
    shared::CompositePush push{};
    push.frame = context.frame;
    push.previous = resources.address(sums_.previous);
    push.sums = resources.address(sums_.current);
    push.color = resources.address(color_);
    for (const graph::Plane signal : signals_) push.signals[push.signalCount++] = resources.address(signal);
    push.restart = context.sampleIndex == 0 || !resources.historyValid(sums_.previous) ? 1 : 0;
    context.commands.dispatch(context.pipeline({"passes/composite/composite.comp", {}, {}}), push, context.width,
                              context.height);

    for (const AovSum& aov : aovs_) {
        shared::AccumulatePush accumulate{};
        accumulate.frame = context.frame;
        for (const graph::Plane value : aov.values)
            accumulate.values[accumulate.valueCount++] = resources.address(value);
        accumulate.previous = resources.address(aov.sum.previous);
        accumulate.sum = resources.address(aov.sum.current);
        accumulate.channels = aov.channels;
        accumulate.restart = context.sampleIndex == 0 || !resources.historyValid(aov.sum.previous) ? 1 : 0;
        context.commands.dispatch(context.pipeline({"passes/composite/accumulate.comp", {}, {}}), accumulate,
                                  context.width, context.height);
    }
}

} // namespace trilume
