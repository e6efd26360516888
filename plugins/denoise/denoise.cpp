#include "denoise.h"

#include "shared/denoise.h"

namespace trilume {

graph::Need DenoiseNode::needed(const graph::SceneFacts& /*facts*/, const ParamSet& params) const {
    return params.getChoice("denoise.mode") == "temporal" ? graph::Need::yes() : graph::Need::no("denoise.mode is off");
}

void DenoiseNode::declare(graph::Builder& builder) {
    signals_.clear();
    for (const char* suffix : {".direct", ".caustic", ".indirect"}) {
        // Nothing casts caustics: the plane is black.
        if (suffix == std::string_view(".caustic") && builder.facts().specularCasters == 0) continue;
        for (const graph::Plane plane : builder.findPlanes(suffix)) {
            builder.read(plane);
            const std::string history = "denoise." + builder.nameOf(plane) + ".history";
            const graph::Plane written = builder.write(plane);
            signals_.push_back({written, builder.historyPlane(history, sizeof(shared::DenoiseHistory))});
        }
    }
    if (signals_.empty()) return;
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    surfaces_ = builder.historyPlane("denoise.surfaces", sizeof(shared::DenoiseSurface));
    reprojection_ = builder.createPlane("denoise.reprojection", sizeof(shared::DenoiseReprojection));
    expected_ = builder.createPlane("denoise.expected", sizeof(shared::DenoiseHistory));
    estimates_[0] = builder.createPlane("denoise.estimate0", sizeof(glm::vec4));
    estimates_[1] = builder.createPlane("denoise.estimate1", sizeof(glm::vec4));
}

uint32_t DenoiseNode::flags(const graph::FrameContext& context) {
    const graph::SceneFacts& facts = context.facts;
    const bool history = context.resources.historyValid(surfaces_.previous);
    const bool changed = !history || (!context.repeats && facts.sceneChanged);
    framesSinceChange_ = changed ? 0 : framesSinceChange_ + 1;

    uint32_t flags = 0;
    if (history) flags |= shared::kDenoiseHistory;
    if (context.repeats || !facts.cameraMoved) flags |= shared::kDenoiseCameraStill;
    if (context.repeats || (!facts.cameraMoved && !facts.geometryChanged)) flags |= shared::kDenoiseStill;
    // Signals that follow a change slowly (probes) are tested until history has forgotten the time before it.
    if (framesSinceChange_ <= context.params.getInt("denoise.maxFrames")) flags |= shared::kDenoiseSceneChanged;
    return flags;
}

void DenoiseNode::execute(graph::FrameContext& context) {
    const uint32_t frameFlags = flags(context);
    shared::DenoiseSurfacesPush push{};
    push.frame = context.frame;
    push.points = context.resources.address(points_);
    push.previous = context.resources.address(surfaces_.previous);
    push.surfaces = context.resources.address(surfaces_.current);
    push.reprojection = context.resources.address(reprojection_);
    push.flags = frameFlags;
    push.maxFrames = static_cast<float>(context.params.getInt("denoise.maxFrames"));
    context.commands.dispatch(context.pipeline({"passes/denoise/surfaces.comp", {}, {}}), push, context.width,
                              context.height);
    for (const Signal& signal : signals_) {
        context.commands.barrier();
        const bool history = context.resources.historyValid(signal.history.previous);
        accumulate(context, signal, history ? frameFlags : frameFlags & ~shared::kDenoiseHistory);
        filter(context, signal);
    }
}

void DenoiseNode::accumulate(graph::FrameContext& context, const Signal& signal, uint32_t flags) const {
    const graph::Resources& resources = context.resources;
    shared::DenoiseExpectPush expect{};
    expect.frame = context.frame;
    expect.reprojection = resources.address(reprojection_);
    expect.previous = resources.address(signal.history.previous);
    expect.expected = resources.address(expected_);
    expect.flags = flags;
    context.commands.dispatch(context.pipeline({"passes/denoise/expect.comp", {}, {}}), expect, context.width,
                              context.height);
    context.commands.barrier();

    shared::DenoiseAccumulatePush push{};
    push.frame = context.frame;
    push.surfaces = resources.address(surfaces_.current);
    push.signal = resources.address(signal.plane);
    push.expected = expect.expected;
    push.history = resources.address(signal.history.current);
    push.flags = flags;
    push.maxFrames = static_cast<float>(context.params.getInt("denoise.maxFrames"));
    push.changeSigma = static_cast<float>(context.params.getFloat("denoise.changeSigma"));
    context.commands.dispatch(context.pipeline({"passes/denoise/accumulate.comp", {}, {}}), push, context.width,
                              context.height);
    context.commands.barrier();
}

void DenoiseNode::filter(graph::FrameContext& context, const Signal& signal) const {
    const graph::Resources& resources = context.resources;
    shared::DenoiseEstimatePush estimate{};
    estimate.frame = context.frame;
    estimate.surfaces = resources.address(surfaces_.current);
    estimate.history = resources.address(signal.history.current);
    estimate.estimate = resources.address(estimates_[0]);
    context.commands.dispatch(context.pipeline({"passes/denoise/estimate.comp", {}, {}}), estimate, context.width,
                              context.height);

    shared::DenoiseFilterPush push{};
    push.frame = context.frame;
    push.surfaces = estimate.surfaces;
    push.to = estimate.estimate;
    push.sigma = static_cast<float>(context.params.getFloat("denoise.sigma"));
    const int64_t levels = context.params.getInt("denoise.levels");
    for (int64_t level = 0; level < levels; ++level) {
        context.commands.barrier();
        push.from = push.to;
        push.to = resources.address(estimates_[(level + 1) % 2]);
        push.spacing = 1 << level;
        context.commands.dispatch(context.pipeline({"passes/denoise/filter.comp", {}, {}}), push, context.width,
                                  context.height);
    }
    context.commands.barrier();

    shared::DenoiseResolvePush resolve{};
    resolve.frame = context.frame;
    resolve.surfaces = estimate.surfaces;
    resolve.history = estimate.history;
    resolve.estimate = push.to;
    resolve.signal = resources.address(signal.plane);
    context.commands.dispatch(context.pipeline({"passes/denoise/resolve.comp", {}, {}}), resolve, context.width,
                              context.height);
}

} // namespace trilume
