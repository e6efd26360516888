#include "denoise.h"

#include "graph/denoised.h"

#include "shared/denoise.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trilume {

namespace {

constexpr int64_t kEmissionTests = 4; // frames after a change in which emission's history is tested
constexpr int kTestLevels = 3;        // squares of 3, 9 and 27 pixels
using Defines = std::vector<std::pair<std::string, std::string>>;

const gpu::Pipeline& pipeline(graph::FrameContext& context, const std::string& pass, size_t signals,
                              Defines defines = {}) {
    defines.emplace_back("TL_SIGNALS", std::to_string(signals));
    return context.pipeline({"passes/denoise/" + pass + ".comp", std::move(defines), {}});
}

uint32_t ceilDivide(uint32_t a, uint32_t b) { return (a + b - 1) / b; }

/// A pass along an axis; what it wrote is the next one's input.
template<typename Push>
void walk(graph::FrameContext& context, const gpu::Pipeline& pipeline, Push& push, uint32_t axis) {
    push.axis = axis;
    const auto spacing = static_cast<uint32_t>(push.spacing);
    const auto threads = [&](uint32_t pixels) { return ceilDivide(pixels, spacing * shared::kDenoiseChain) * spacing; };
    context.commands.dispatch(pipeline, push, axis == 0 ? threads(context.width) : context.width,
                              axis == 0 ? context.height : threads(context.height));
    context.commands.barrier();
    std::swap(push.from, push.to);
}

} // namespace

graph::Need DenoiseNode::needed(const graph::SceneFacts& /*facts*/, const ParamSet& params) const {
    return graph::denoised(params) ? graph::Need::yes() : graph::Need::no("denoise.mode is off");
}

void DenoiseNode::declare(graph::Builder& builder) {
    signals_.clear();
    emission_ = emitters_ = {};
    const auto emitters = builder.findPlanes("visibility.emitters"); // nothing is wrong where there are none
    if (!emitters.empty()) {
        builder.read(emitters_ = emitters.front());
        const graph::Plane emission = builder.findPlane("visibility.emission");
        builder.read(emission);
        emission_ = builder.write(emission);
        emissionHistory_ = builder.historyPlane("denoise.emission.history", sizeof(shared::DenoiseEmission));
    }
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
    const bool moved = !context.repeats && (context.facts.sceneChanged || context.facts.cameraMoved);
    if (emission_) accumulateEmission(context, moved);
    if (signals_.empty()) return;
    const uint32_t flags = reproject(context);
    const bool begins = !context.resources.historyValid(surfaces_.previous);
    const uint64_t lighting = context.facts.lightingRevision;
    const bool changed = lighting != std::exchange(lighting_, lighting);
    framesSinceChange_ = begins ? kNever : changed ? 0 : framesSinceChange_ + 1;
    const std::span<const Signal> signals(signals_);
    for (size_t first = 0; first < signals.size(); first += shared::kDenoiseBatch) {
        const auto batch = signals.subspan(first, std::min<size_t>(signals.size() - first, shared::kDenoiseBatch));
        context.commands.barrier();
        accumulate(context, batch, flags);
        if (context.params.getInt("denoise.levels") > 0) filter(context, batch);
    }
}

uint32_t DenoiseNode::reproject(graph::FrameContext& context) const {
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
    return push.flags;
}

void DenoiseNode::accumulateEmission(graph::FrameContext& context, bool changed) {
    const graph::Resources& resources = context.resources;
    const bool history = resources.historyValid(emissionHistory_.previous);
    framesAtRest_ = !history ? kNever : changed ? 0 : framesAtRest_ + 1;
    shared::DenoiseEmissionPush push{};
    push.frame = context.frame;
    push.emission = resources.address(emission_);
    push.emitters = resources.address(emitters_);
    push.previous = resources.address(emissionHistory_.previous);
    push.histories = resources.address(emissionHistory_.current);
    if (history) push.flags |= shared::kDenoiseHistory;
    if (context.repeats || !context.facts.cameraMoved) push.flags |= shared::kDenoiseCameraStill;
    push.maxFrames = static_cast<float>(context.params.getInt("denoise.maxFrames"));
    const auto pass = [&](const std::string& name, Defines defines) -> const gpu::Pipeline& {
        return context.pipeline({"passes/denoise/" + name + ".comp", std::move(defines), {}});
    };
    // All that a change needs is made with the first picture.
    const gpu::Pipeline& expect = pass("expect_emission", {});
    const gpu::Pipeline& accumulateExpected = pass("accumulate_emission", {{"TL_EXPECTED", "1"}});
    const gpu::Pipeline& accumulateAtRest = pass("accumulate_emission", {{"TL_EXPECTED", "0"}});
    const bool test = history && framesAtRest_ < kEmissionTests;
    if (test) {
        context.commands.dispatch(expect, push, context.width, context.height);
        context.commands.barrier();
    }
    context.commands.dispatch(test ? accumulateExpected : accumulateAtRest, push, context.width, context.height);
}

void DenoiseNode::accumulate(graph::FrameContext& context, std::span<const Signal> batch, uint32_t flags) const {
    const graph::Resources& resources = context.resources;
    const int64_t maxFrames = context.params.getInt("denoise.maxFrames");
    shared::DenoiseAccumulatePush push{};
    push.frame = context.frame;
    push.surfaces = resources.address(surfaces_.current);
    push.reprojection = resources.address(reprojection_);
    push.maxFrames = static_cast<float>(maxFrames);
    push.flags = flags & ~shared::kDenoiseHistory;
    if (context.params.getInt("denoise.levels") == 0) push.flags |= shared::kDenoiseUnfiltered;
    for (size_t i = 0; i < batch.size(); ++i) {
        push.signals[i] = resources.address(batch[i].plane);
        push.previous[i] = resources.address(batch[i].history.previous);
        push.histories[i] = resources.address(batch[i].history.current);
        push.differences[i] = resources.address(estimates_[0][i]);
        if (resources.historyValid(batch[i].history.previous)) push.flags |= shared::kDenoiseHistory << i;
    }
    // Signals that follow a change slowly (probes) are tested until history has forgotten the time before it, less and
    // less readily: a scene at rest is not tested at all, and its mean is the mean of its frames.
    const bool test = framesSinceChange_ < maxFrames;
    // All that a change needs is made with the first picture.
    const gpu::Pipeline& expect = pipeline(context, "expect", batch.size());
    const gpu::Pipeline& sumOfChanges = pipeline(context, "sum", batch.size(), {{"TL_CHANGES", "1"}});
    const gpu::Pipeline& testOfChanges = pipeline(context, "test", batch.size(), {{"TL_CHANGES", "1"}});
    const gpu::Pipeline& accumulateExpected = pipeline(context, "accumulate", batch.size(), {{"TL_EXPECTED", "1"}});
    const gpu::Pipeline& accumulateAtRest = pipeline(context, "accumulate", batch.size(), {{"TL_EXPECTED", "0"}});
    if (test) {
        context.commands.dispatch(expect, push, context.width, context.height);
        context.commands.barrier();
        shared::DenoiseSumPush sum = sumPush(context, batch);
        sum.changeSigma = static_cast<float>(context.params.getFloat("denoise.changeSigma") *
                                             std::sqrt(1.0 + static_cast<double>(framesSinceChange_)));
        for (int level = 0; level < kTestLevels; ++level) {
            walk(context, sumOfChanges, sum, 0);
            walk(context, testOfChanges, sum, 1);
            sum.spacing *= 3;
        }
    }
    context.commands.dispatch(test ? accumulateExpected : accumulateAtRest, push, context.width, context.height);
    context.commands.barrier();
}

void DenoiseNode::filter(graph::FrameContext& context, std::span<const Signal> batch) const {
    const graph::Resources& resources = context.resources;
    shared::DenoiseSumPush sum = sumPush(context, batch);
    walk(context, pipeline(context, "sum", batch.size(), {{"TL_CHANGES", "0"}}), sum, 0);
    walk(context, pipeline(context, "estimate", batch.size(), {{"TL_CHANGES", "0"}}), sum, 1);

    shared::DenoiseFilterPush push{};
    push.frame = context.frame;
    push.surfaces = sum.surfaces;
    for (size_t i = 0; i < batch.size(); ++i) {
        push.histories[i] = sum.histories[i];
        push.from[i] = sum.from[i];
        push.to[i] = sum.to[i];
        push.signals[i] = resources.address(batch[i].plane);
    }
    push.sigma = static_cast<float>(context.params.getFloat("denoise.sigma"));
    const int64_t levels = context.params.getInt("denoise.levels");
    for (int64_t level = 0; level < levels; ++level) {
        push.spacing = level == 0 ? 1 : 3 * push.spacing;
        const bool last = level + 1 == levels;
        walk(context, pipeline(context, "filter", batch.size(), {{"TL_LAST", "0"}}), push, 0);
        walk(context, pipeline(context, "filter", batch.size(), {{"TL_LAST", last ? "1" : "0"}}), push, 1);
    }
}

shared::DenoiseSumPush DenoiseNode::sumPush(const graph::FrameContext& context, std::span<const Signal> batch) const {
    shared::DenoiseSumPush push{};
    push.frame = context.frame;
    push.surfaces = context.resources.address(surfaces_.current);
    for (size_t i = 0; i < batch.size(); ++i) {
        push.histories[i] = context.resources.address(batch[i].history.current);
        push.from[i] = context.resources.address(estimates_[0][i]);
        push.to[i] = context.resources.address(estimates_[1][i]);
    }
    push.spacing = 1;
    return push;
}

} // namespace trilume
