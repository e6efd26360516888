#include "restir_di.h"

#include "shared/restir_di.h"

#include <algorithm>

namespace trilume {

namespace {

/// Among so few lights a tile learns the ones that matter, and plain resampling is good at about the cost of ray
/// tracing; what reuse gains costs about as much time (README.md, Cost).
constexpr uint32_t kFewLights = 32;
/// Reuse makes one frame better, but couples frames: the average of many is better when they stand alone.
constexpr uint32_t kCoupledFrames = 16;

bool fewLights(const graph::SceneFacts& facts) { return facts.lights <= kFewLights && !facts.environment; }

uint32_t tilesAcross(uint32_t pixels) { return (pixels + shared::kTileSide - 1) / shared::kTileSide; }

/// More than one for each light add little but cost; a dome is worth several.
uint32_t usefulCandidates(const graph::SceneFacts& facts) {
    if (facts.environment) return std::max(facts.lights, 8u);
    return facts.lights <= 2 ? 1 : facts.lights;
}

} // namespace

RestirDiNode::Choice RestirDiNode::choose(const graph::SceneFacts& facts, const ParamSet& params) {
    const std::string& wanted = params.getChoice("restir_di.reuse");
    if (wanted == "off") return {Reuse::Off, ""};
    if (wanted == "temporal") return {Reuse::Temporal, ""};
    if (wanted == "spatiotemporal") return {Reuse::Spatiotemporal, ""};
    if (fewLights(facts)) return {Reuse::Off, "no reuse: too few lights to gain by it"};
    return {Reuse::Temporal, ""};
}

graph::Need RestirDiNode::needed(const graph::SceneFacts& facts, const ParamSet& params) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    return {true, choose(facts, params).reason};
}

void RestirDiNode::declare(graph::Builder& builder) {
    builder.owns(graph::PathClass::Direct);
    reuse_ = choose(builder.facts(), builder.params()).reuse;
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    direct_ = builder.createPlane("restir_di.direct", sizeof(glm::vec3));
    previousPoints_ = merged_ = neighbors_ = {};
    reservoirs_ = {};
    chosen_ = {};
    tiles_ = {};
    if (builder.facts().lights > 1) {
        chosen_ = builder.createPlane("restir_di.chosen", sizeof(shared::ChosenLight));
        tiles_ =
            builder.persistentBuffer("restir_di.tiles", size_t{tilesAcross(builder.width())} *
                                                            tilesAcross(builder.height()) * sizeof(shared::LightTile));
    }
    if (reuse_ == Reuse::Off) return;
    previousPoints_ = builder.findPlane("visibility.points.previous");
    builder.read(previousPoints_);
    merged_ = builder.createPlane("restir_di.merged", sizeof(shared::Reservoir));
    neighbors_ = builder.createPlane("restir_di.neighbors", sizeof(shared::TemporalNeighbor));
    reservoirs_ = builder.historyPlane("restir_di.reservoirs", sizeof(shared::Reservoir));
}

void RestirDiNode::execute(graph::FrameContext& context) {
    const graph::Resources& resources = context.resources;
    const ParamSet& params = context.params;
    const bool spatial = reuse_ == Reuse::Spatiotemporal;
    const bool history = resources.historyValid(reservoirs_.previous) && resources.historyValid(previousPoints_);
    shared::RestirPush push{};
    push.frame = context.frame;
    push.points = resources.address(points_);
    push.previousPoints = resources.address(previousPoints_);
    push.previous = resources.address(reservoirs_.previous);
    push.neighbors = resources.address(neighbors_);
    push.merged = resources.address(merged_);
    push.final = resources.address(reservoirs_.current);
    push.direct = resources.address(direct_);
    push.chosen = resources.address(chosen_);
    push.tiles = resources.address(tiles_);
    push.learned = tiles_ && resources.historyValid(tiles_) ? 1 : 0;
    push.lightCandidates =
        std::min(static_cast<uint32_t>(params.getInt("restir_di.lightCandidates")), usefulCandidates(context.facts));
    push.learnedCandidates = std::min(static_cast<uint32_t>(params.getInt("restir_di.learnedCandidates")),
                                      std::max(push.lightCandidates, 2u));
    push.bsdfCandidates = static_cast<uint32_t>(params.getInt("restir_di.bsdfCandidates"));
    push.bsdfRoughness = static_cast<float>(params.getFloat("restir_di.bsdfRoughness"));
    push.maxHistory = static_cast<float>(params.getInt("restir_di.maxHistory"));
    push.spatialNeighbors = spatial ? static_cast<uint32_t>(params.getInt("restir_di.spatialNeighbors")) : 0;
    push.radius = static_cast<float>(params.getFloat("restir_di.radius"));
    push.history = history ? 1 : 0;
    const bool alone = params.getChoice("restir_di.reuse") == "auto" && context.sampleIndex >= kCoupledFrames;
    push.alone = alone ? 1 : 0;

    const char* unbiased = params.getChoice("restir_di.mode") == "unbiased" ? "1" : "0";
    const auto dispatch = [&](const char* shader, std::vector<std::pair<std::string, std::string>> defines) {
        defines.emplace_back("TL_UNBIASED", unbiased);
        defines.emplace_back("TL_CHOICE", tiles_ ? "1" : "0");
        context.commands.dispatch(context.pipeline({shader, std::move(defines), {}}), push, context.width,
                                  context.height);
    };
    dispatch("passes/restir_di/candidates.comp", {{"TL_REUSE", reuse_ == Reuse::Off ? "0" : "1"},
                                                  {"TL_BSDF_EVERYWHERE", push.bsdfRoughness >= 1 ? "1" : "0"}});
    // Without history it finds no neighbours, but its pipeline is made with the others before the first picture.
    if (reuse_ != Reuse::Off && !alone) {
        context.commands.barrier();
        dispatch("passes/restir_di/temporal.comp", {{"TL_LAST_FRAME", "1"}});
        context.commands.barrier();
        dispatch("passes/restir_di/spatial.comp", {});
    }
    if (tiles_) learn(context, push.learned == 0);
}

void RestirDiNode::learn(graph::FrameContext& context, bool restart) const {
    shared::LearnPush push{};
    push.frame = context.frame;
    push.chosen = context.resources.address(chosen_);
    push.tiles = context.resources.address(tiles_);
    push.restart = restart ? 1 : 0;
    context.commands.barrier();
    context.commands.dispatch(context.pipeline({"passes/restir_di/learn.comp", {{"TL_CHOICE", "1"}}, {}}), push,
                              tilesAcross(context.width), tilesAcross(context.height));
}

} // namespace trilume
