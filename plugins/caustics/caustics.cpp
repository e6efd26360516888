#include "caustics.h"

#include "shared/caustics.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace trilume {

namespace {

constexpr size_t kFixedBytes = 6 * sizeof(uint32_t); // shaders/lib/fixed_point.glsl
constexpr double kFewestPhotons = 1024;
constexpr uint32_t kCachedFrames = 1024;

/// Radius in frame n (from 0) of an average over that in frame 0: r_{n+1}^2 = r_n^2 (n + a) / (n + 1) with n counted
/// from 1 and a = 2/3 (Hachisuka 2008; Knaus and Zwicker 2011, eq. 15). The product is a ratio of gamma functions.
double shrink(uint32_t n) {
    constexpr double kAlpha = 2.0 / 3.0;
    return std::exp(0.5 * (std::lgamma(n + 1 + kAlpha) - std::lgamma(1 + kAlpha) - std::lgamma(n + 2.0)));
}

/// The denoiser averages over frames itself, and tells noise by how much frames differ.
bool denoised(const ParamSet& params) {
    return params.table().find("denoise.mode") && params.getChoice("denoise.mode") == "temporal";
}

} // namespace

graph::Need CausticsNode::needed(const graph::SceneFacts& facts, const ParamSet& /*params*/) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (facts.specularCasters == 0) return graph::Need::no("no mirrors and no glass");
    return graph::Need::yes();
}

void CausticsNode::declare(graph::Builder& builder) {
    builder.owns(graph::PathClass::Caustic);
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
    splats_ = builder.createPlane("caustics.splats", kFixedBytes);
    photons_ = builder.createBuffer("caustics.photons", photonLimit_ * sizeof(shared::Photon));
    heads_ = builder.createBuffer("caustics.heads", cells_ * sizeof(uint32_t));
    guide_ = builder.historyBuffer("caustics.guide",
                                   shared::kGuideGroups * shared::kGuideTargets * sizeof(shared::GuideTarget));
    state_ = builder.historyBuffer("caustics.state", sizeof(shared::CausticState));
    cache_ = builder.historyBuffer("caustics.cache", shared::kCausticPatches * sizeof(shared::CausticPatch));
    cacheSums_ = builder.createBuffer("caustics.cacheSums", shared::kCausticPatches * kFixedBytes);
}

void CausticsNode::execute(graph::FrameContext& context) {
    const auto& resources = context.resources;
    const bool known = resources.historyValid(state_.previous);
    const bool unchanged = known && lighting_ == context.facts.lightingRevision;
    lighting_ = context.facts.lightingRevision;
    cachedFrames_ = unchanged ? std::min(cachedFrames_ + 1, kCachedFrames) : 1;

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
    push.cache = resources.address(cache_.current);
    push.cacheSums = resources.address(cacheSums_);
    push.previousGuide = resources.address(guide_.previous);
    push.previousState = resources.address(state_.previous);
    push.previousCache = resources.address(cache_.previous);
    if (known) push.flags |= shared::kCausticsHistory;
    if (unchanged && resources.historyValid(mean_.previous)) push.flags |= shared::kCausticsUnchanged;
    // Later frames of an average are seen from where the first was.
    if (context.facts.cameraMoved && context.sampleIndex == 0) push.flags |= shared::kCausticsCameraMoved;
    if (context.params.getChoice("caustics.direct") == "kernel") push.flags |= shared::kCausticsKernel;
    push.historyFrames =
        denoised(context.params) ? 1.0f : static_cast<float>(context.params.getInt("caustics.historyFrames"));
    push.uniformShare = static_cast<float>(context.params.getFloat("caustics.uniformShare"));
    push.gatherRadius =
        static_cast<float>(context.params.getFloat("caustics.gatherRadius") * shrink(context.sampleIndex));
    push.cacheShare = 1.0f / static_cast<float>(cachedFrames_);
    push.photonLimit = photonLimit_;
    push.headMask = cells_ - 1;

    const auto run = [&](const char* pass, uint32_t x, uint32_t y = 1) {
        const std::string path = std::string("passes/caustics/") + pass + ".comp";
        context.commands.dispatch(context.pipeline({path, {}, {}}), push, x, y);
    };
    run("clear", std::max({context.width * context.height, cells_, shared::kCausticPatches}));
    run("learn", shared::kGuideGroups * shared::kGuideCells);
    context.commands.barrier();
    run("carry", shared::kCausticPatches);
    run("photons", photonLimit_);
    context.commands.barrier();
    run("gather", context.width, context.height);
    run("resolve", shared::kCausticPatches);
}

} // namespace trilume
