#include "caustics.h"

#include "graph/denoised.h"

#include "shared/caustics.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace trilume {

namespace {

constexpr size_t kFixedBytes = 6 * sizeof(uint32_t); // shaders/lib/fixed_point.glsl
constexpr double kFewestPhotons = 1024;
constexpr double kCachedFrames = 1024;
constexpr uint32_t kFollowFrames = 8; // after a change, with all photons

/// Radius in frame n (from 0) of an average over that in frame 0: r_{n+1}^2 = r_n^2 (n + a) / (n + 1) with n counted
/// from 1 and a = 2/3 (Hachisuka 2008; Knaus and Zwicker 2011, eq. 15). The product is a ratio of gamma functions.
double shrink(uint32_t n) {
    constexpr double kAlpha = 2.0 / 3.0;
    return std::exp(0.5 * (std::lgamma(n + 1 + kAlpha) - std::lgamma(1 + kAlpha) - std::lgamma(n + 2.0)));
}

} // namespace

graph::Need CausticsNode::needed(const graph::SceneFacts& facts, const ParamSet& /*params*/) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (facts.specularCasters == 0) return graph::Need::no("no mirrors and no glass");
    return graph::Need::yes();
}

void CausticsNode::declare(graph::Builder& builder) {
    builder.owns(graph::PathClass::Caustic);
    stillFrames_ = 0;
    const double pixels = static_cast<double>(builder.width()) * builder.height();
    const double perPicture = builder.params().getFloat("caustics.photonsPerPixel") * pixels;
    const auto most = static_cast<double>(builder.params().getInt("caustics.photons"));
    photonLimit_ = static_cast<uint32_t>(std::min(most, std::max(perPicture, kFewestPhotons)));
    cells_ = std::bit_ceil(photonLimit_);

    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    previousPoints_ = builder.findPlane("visibility.points.previous");
    builder.read(previousPoints_);
    caustic_ = builder.createPlane("caustics.caustic", sizeof(glm::vec3));
    mean_ = builder.historyPlane("caustics.mean", sizeof(glm::vec4));
    splats_ = builder.persistentBuffer("caustics.splats", size_t{builder.width()} * builder.height() * kFixedBytes);
    photons_ = builder.createBuffer("caustics.photons", photonLimit_ * sizeof(shared::Photon));
    heads_ = builder.createBuffer("caustics.heads", cells_ * sizeof(uint32_t));
    guide_ = builder.historyBuffer("caustics.guide",
                                   shared::kGuideGroups * shared::kGuideTargets * sizeof(shared::GuideTarget));
    state_ = builder.historyBuffer("caustics.state", sizeof(shared::CausticState));
    cache_ = builder.persistentBuffer("caustics.cache", shared::kCausticPatches * sizeof(shared::CausticPatch));
    cacheSums_ = builder.persistentBuffer("caustics.cacheSums", shared::kCausticPatches * kFixedBytes);
    cacheCounts_ = builder.persistentBuffer("caustics.cacheCounts", shared::kCausticPatches * sizeof(uint32_t));
}

void CausticsNode::execute(graph::FrameContext& context) {
    const auto& resources = context.resources;
    const bool known = resources.historyValid(state_.previous) && resources.historyValid(mean_.previous);
    const bool unchanged = known && lighting_ == context.facts.lightingRevision;
    lighting_ = context.facts.lightingRevision;
    // Where pixels remember, those of a still picture need few more.
    const int64_t historyFrames = graph::denoised(context.params) ? 1 : context.params.getInt("caustics.historyFrames");
    const bool remembering = context.sampleIndex == 0 && historyFrames > 1;
    stillFrames_ = remembering && unchanged && !context.facts.cameraMoved ? stillFrames_ + 1 : 0;
    const bool settled = stillFrames_ >= kFollowFrames;
    const double share = settled ? context.params.getFloat("caustics.settledShare") : 1.0;
    cachedFrames_ = unchanged ? std::min(cachedFrames_ + share, kCachedFrames) : 1;

    shared::CausticsPush push{};
    push.frame = context.frame;
    push.points = resources.address(points_);
    push.previousPoints = resources.address(previousPoints_);
    push.mean = resources.address(mean_.current);
    push.previousMean = resources.address(mean_.previous);
    push.caustic = resources.address(caustic_);
    push.splats = resources.address(splats_);
    push.guide = resources.address(guide_.current);
    push.state = resources.address(state_.current);
    push.photons = resources.address(photons_);
    push.heads = resources.address(heads_);
    push.cache = resources.address(cache_);
    push.cacheSums = resources.address(cacheSums_);
    push.cacheCounts = resources.address(cacheCounts_);
    push.previousGuide = resources.address(guide_.previous);
    push.previousState = resources.address(state_.previous);
    if (known) push.flags |= shared::kCausticsHistory;
    if (unchanged) push.flags |= shared::kCausticsUnchanged;
    // Later frames of an average are seen from where the first was.
    if (context.facts.cameraMoved && context.sampleIndex == 0) push.flags |= shared::kCausticsCameraMoved;
    if (context.params.getChoice("caustics.direct") == "kernel") push.flags |= shared::kCausticsKernel;
    push.share = static_cast<float>(share);
    push.historyFrames = static_cast<float>(historyFrames);
    push.uniformShare = static_cast<float>(context.params.getFloat("caustics.uniformShare"));
    push.gatherRadius =
        static_cast<float>(context.params.getFloat("caustics.gatherRadius") * shrink(context.sampleIndex));
    push.cacheShare = static_cast<float>(std::min(share / cachedFrames_, 1.0));
    push.photonLimit = photonLimit_;
    push.headMask = cells_ - 1;

    const uint32_t groups = std::min(context.facts.lights, shared::kGuideGroups);
    push.knownGroups = known ? std::min(knownGroups_, groups) : 0;
    push.knownCasters = known ? knownCasters_ : 0;
    knownGroups_ = groups;
    knownCasters_ = context.facts.specularCasters;

    const auto run = [&](const char* pass, uint32_t x, uint32_t y = 1) {
        const std::string path = std::string("passes/caustics/") + pass + ".comp";
        context.commands.dispatch(context.pipeline({path, {}, {}}), push, x, y);
    };
    const uint32_t sums = known ? 0 : std::max(context.width * context.height, shared::kCausticPatches);
    run("clear", std::max({cells_, unchanged ? 0 : shared::kCausticPatches, sums}));
    run("learn", groups * shared::kGuideCells);
    context.commands.barrier();
    run("photons", graph::spread(photonLimit_));
    context.commands.barrier();
    run("gather", context.width, context.height);
    run("resolve", shared::kCausticPatches);
}

} // namespace trilume
