#include "denoise.h"

#include "shared/denoise.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trilume {

namespace {

constexpr int kTestLevels = 3; // squares of 3, 9 and 27 pixels

} // namespace

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
    for (size_t i = 0; i < std::min<size_t>(signals_.size(), shared::kDenoiseBatch); ++i)
        for (size_t side = 0; side < 2; ++side)
            estimates_[side][i] =
                builder.createPlane("denoise.estimate" + std::to_string(2 * i + side), sizeof(glm::vec4));
}

void DenoiseNode::execute(graph::FrameContext& context) {
    reproject(context);
    const bool begins = !context.resources.historyValid(surfaces_.previous);
    const bool changed = !context.repeats && context.facts.sceneChanged;
    framesSinceChange_ = begins ? kNever : changed ? 0 : framesSinceChange_ + 1;
    for (const Signal& signal : signals_) {
        context.commands.barrier();
        accumulate(context, signal);
    }
    const std::span<const Signal> signals(signals_);
    for (size_t first = 0; first < signals.size(); first += shared::kDenoiseBatch)
        filter(context, signals.subspan(first, std::min<size_t>(signals.size() - first, shared::kDenoiseBatch)));
}

void DenoiseNode::reproject(graph::FrameContext& context) const {
    const graph::SceneFacts& facts = context.facts;
    shared::DenoiseSurfacesPush push{};
    push.frame = context.frame;
    push.points = context.resources.address(points_);
    push.previous = context.resources.address(surfaces_.previous);
    push.surfaces = context.resources.address(surfaces_.current);
    push.reprojection = context.resources.address(reprojection_);
    push.maxFrames = static_cast<float>(context.params.getInt("denoise.maxFrames"));
    if (context.resources.historyValid(surfaces_.previous)) push.flags |= shared::kDenoiseHistory;
    if (context.repeats || !facts.cameraMoved) push.flags |= shared::kDenoiseCameraStill;
    if (context.repeats || (!facts.cameraMoved && !facts.geometryChanged)) push.flags |= shared::kDenoiseStill;
    context.commands.dispatch(context.pipeline({"passes/denoise/surfaces.comp", {}, {}}), push, context.width,
                              context.height);
}

void DenoiseNode::accumulate(graph::FrameContext& context, const Signal& signal) const {
    const graph::Resources& resources = context.resources;
    shared::DenoiseExpectPush expect{};
    expect.frame = context.frame;
    expect.surfaces = resources.address(surfaces_.current);
    expect.reprojection = resources.address(reprojection_);
    expect.signal = resources.address(signal.plane);
    expect.previous = resources.address(signal.history.previous);
    expect.history = resources.address(signal.history.current);
    expect.difference = resources.address(estimates_[0][0]);
    expect.flags = resources.historyValid(signal.history.previous) ? shared::kDenoiseHistory : 0;
    context.commands.dispatch(context.pipeline({"passes/denoise/expect.comp", {}, {}}), expect, context.width,
                              context.height);
    context.commands.barrier();

    shared::DenoiseTestPush change{};
    change.frame = context.frame;
    change.surfaces = expect.surfaces;
    change.history = expect.history;
    change.to = expect.difference;
    // Signals that follow a change slowly (probes) are tested until history has forgotten the time before it, less and
    // less readily: a scene at rest is not tested at all, and its mean is the mean of its frames.
    const int64_t maxFrames = context.params.getInt("denoise.maxFrames");
    const bool test = framesSinceChange_ < maxFrames;
    change.changeSigma = static_cast<float>(context.params.getFloat("denoise.changeSigma") *
                                            std::sqrt(1.0 + static_cast<double>(framesSinceChange_)));
    for (int level = 0; test && level < kTestLevels; ++level) {
        change.from = change.to;
        change.to = resources.address(estimates_[(level + 1) % 2][0]);
        change.spacing = level == 0 ? 1 : 3 * change.spacing;
        context.commands.dispatch(context.pipeline({"passes/denoise/test.comp", {}, {}}), change, context.width,
                                  context.height);
        context.commands.barrier();
    }

    shared::DenoiseAccumulatePush push{};
    push.frame = context.frame;
    push.signal = expect.signal;
    push.history = expect.history;
    push.maxFrames = static_cast<float>(maxFrames);
    context.commands.dispatch(context.pipeline({"passes/denoise/accumulate.comp", {}, {}}), push, context.width,
                              context.height);
    context.commands.barrier();
}

void DenoiseNode::filter(graph::FrameContext& context, std::span<const Signal> batch) const {
    const graph::Resources& resources = context.resources;
    const std::vector<std::pair<std::string, std::string>> defines{{"TL_SIGNALS", std::to_string(batch.size())}};
    const VkDeviceAddress surfaces = resources.address(surfaces_.current);
    shared::DenoiseEstimatePush estimate{};
    shared::DenoiseFilterPush push{};
    for (size_t i = 0; i < batch.size(); ++i) {
        estimate.histories[i] = resources.address(batch[i].history.current);
        estimate.estimates[i] = push.to[i] = resources.address(estimates_[0][i]);
        push.from[i] = resources.address(estimates_[1][i]);
    }
    estimate.frame = push.frame = context.frame;
    estimate.surfaces = push.surfaces = surfaces;
    context.commands.dispatch(context.pipeline({"passes/denoise/estimate.comp", defines, {}}), estimate, context.width,
                              context.height);

    push.sigma = static_cast<float>(context.params.getFloat("denoise.sigma"));
    const int64_t levels = context.params.getInt("denoise.levels");
    for (int64_t level = 0; level < levels; ++level) {
        context.commands.barrier();
        std::swap(push.from, push.to);
        push.spacing = 1 << level;
        context.commands.dispatch(context.pipeline({"passes/denoise/filter.comp", defines, {}}), push, context.width,
                                  context.height);
    }
    context.commands.barrier();

    shared::DenoiseResolvePush resolve{};
    resolve.frame = context.frame;
    resolve.surfaces = surfaces;
    for (size_t i = 0; i < batch.size(); ++i) {
        resolve.history = estimate.histories[i];
        resolve.estimate = push.to[i];
        resolve.signal = resources.address(batch[i].plane);
        context.commands.dispatch(context.pipeline({"passes/denoise/resolve.comp", {}, {}}), resolve, context.width,
                                  context.height);
    }
    context.commands.barrier();
}

} // namespace trilume
