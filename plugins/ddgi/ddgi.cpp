#include "ddgi.h"

#include "shared/ddgi.h"

#include <algorithm>
#include <cmath>

namespace trilume {

namespace {

constexpr uint32_t kPlacingRays = 32;
constexpr uint32_t kBounceRays = 16;
constexpr uint32_t kFirstProbes = 4096; // beyond which the first frame's rounds spare rays
constexpr uint32_t kFewestRays = 8;     // of a probe that spares them
constexpr uint32_t kPlacingRounds = 4;  // a probe in a corner leaves it through three walls
constexpr uint32_t kFirstRounds = 3;    // of means, in the first frame
constexpr uint32_t kRelitFrames = 16;   // after a change of the lights, in which probes spare rays for more turns
constexpr uint32_t kFollowFrames = 32;  // after a change of the scene, for which probes get the whole budget
constexpr double kRestPeriod = 8;       // frames of a scene that stands still, at most, of which one updates probes

/// Distance of the outermost planes inside the bounds from the bounds, in steps: walls there have probes at hand.
constexpr float kInset = 0.06f;

/// At least two planes inside, and one outside each side.
ProbeGrid gridOfSpacing(glm::vec3 boundsMin, glm::vec3 boundsMax, float spacing) {
    ProbeGrid grid{.boundsMin = boundsMin, .boundsMax = boundsMax};
    const glm::vec3 size = boundsMax - boundsMin;
    const glm::vec3 intervals = glm::max(glm::ceil(size / spacing - 2 * kInset), glm::vec3(1));
    grid.steps = glm::max(size / (intervals + 2 * kInset), glm::vec3(0.5f * spacing));
    grid.counts = glm::uvec3(intervals) + 3u;
    grid.origin = 0.5f * (boundsMin + boundsMax) - 0.5f * grid.steps * (intervals + 2.0f);
    return grid;
}

/// For bounds that have outgrown `before`: likely to go on, so there is room for eight times as much, up to half the
/// size.
ProbeGrid outgrown(const ProbeGrid& before, glm::vec3 min, glm::vec3 max, uint32_t limit) {
    const glm::vec3 room = 0.45f * (max - min);
    const glm::vec3 below = glm::max(before.boundsMin - min, glm::vec3(0));
    const glm::vec3 above = glm::max(max - before.boundsMax, glm::vec3(0));
    return fitProbeGrid(min - glm::min(8.0f * below, room), max + glm::min(8.0f * above, room), limit);
}

/// Frames whose share of rays is saved for one update: passes that are all but empty cost as much as these rays.
uint32_t restPeriod(const ParamSet& params) {
    const double share = params.getFloat("ddgi.settledShare");
    return static_cast<uint32_t>(std::clamp(1 / std::max(share, 1e-3), 1.0, kRestPeriod));
}

} // namespace

bool ProbeGrid::serves(glm::vec3 min, glm::vec3 max) const {
    const glm::vec3 size = max - min, covered = boundsMax - boundsMin;
    const glm::vec3 slack = 0.5f * steps;
    return glm::all(glm::greaterThanEqual(min, boundsMin - slack)) &&
           glm::all(glm::lessThanEqual(max, boundsMax + slack)) &&
           glm::all(glm::greaterThanEqual(size, 0.5f * covered));
}

ProbeGrid fitProbeGrid(glm::vec3 boundsMin, glm::vec3 boundsMax, uint32_t limit) {
    const glm::vec3 size = boundsMax - boundsMin;
    const float longest = std::max({size.x, size.y, size.z});
    ProbeGrid grid = gridOfSpacing(boundsMin, boundsMax, longest > 0 ? longest : 1);
    for (float spacing = longest; spacing > 0; spacing *= 0.97f) {
        const ProbeGrid finer = gridOfSpacing(boundsMin, boundsMax, spacing);
        const glm::dvec3 counts(finer.counts);
        if (counts.x * counts.y * counts.z > limit) break;
        grid = finer;
    }
    return grid;
}

graph::Need DdgiNode::needed(const graph::SceneFacts& facts, const ParamSet& /*params*/) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (!facts.diffuseAlbedo) return graph::Need::no("nothing reflects diffusely");
    return graph::Need::yes();
}

void DdgiNode::declare(graph::Builder& builder) {
    limit_ = static_cast<uint32_t>(builder.params().getInt("ddgi.probes"));
    raysPerProbe_ = static_cast<uint32_t>(builder.params().getInt("ddgi.rays"));
    const size_t probes = limit_;

    builder.owns(graph::PathClass::Indirect);
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    causticCache_ = builder.findBuffer("caustics.cache");
    if (causticCache_) builder.read(causticCache_);
    volume_ = builder.persistentBuffer("ddgi.volume", sizeof(shared::ProbeVolume));
    probes_ = builder.persistentBuffer("ddgi.probes", probes * sizeof(shared::Probe));
    irradiance_ =
        builder.persistentBuffer("ddgi.irradiance", probes * shared::kProbeIrradianceNodes * sizeof(glm::vec3));
    distances_ = builder.persistentBuffer("ddgi.distances", probes * shared::kProbeDistanceNodes * sizeof(uint32_t));
    turns_ = builder.createBuffer("ddgi.turns", probes * sizeof(shared::ProbeTurn));
    rays_ = builder.createBuffer("ddgi.rays", probes * raysPerProbe_ * sizeof(shared::ProbeRay));
    indirect_ = builder.createPlane("ddgi.indirect", sizeof(glm::vec3));
    lookups_ = {};
    if (builder.params().getChoice("ddgi.gather") == "probe")
        lookups_ = builder.persistentBuffer("ddgi.lookups",
                                            size_t{builder.width()} * builder.height() * sizeof(shared::ProbeLookup));
}

void DdgiNode::execute(graph::FrameContext& context) {
    const graph::SceneFacts& facts = context.facts;
    const bool fresh = !context.resources.historyValid(probes_);
    const bool restart = fresh || !grid_.serves(facts.boundsMin, facts.boundsMax);
    const bool changed = lightingRevision_ != facts.lightingRevision;
    lightingRevision_ = facts.lightingRevision;
    const bool relit = changed && facts.changedLights > 0;
    const bool roused = changed && followFrames_ == 0;
    relitFrames_ = relit ? kRelitFrames : relitFrames_ - std::min(relitFrames_, 1u);
    if (restart)
        followFrames_ = relitFrames_ = restFrames_ = standingFrames_ = 0;
    else if (changed)
        followFrames_ = std::max(kFollowFrames * grid_.probes() / kFirstProbes, kFollowFrames);
    else if (followFrames_ > 0)
        --followFrames_;
    if (restart)
        grid_ = fresh ? fitProbeGrid(facts.boundsMin, facts.boundsMax, limit_)
                      : outgrown(grid_, facts.boundsMin, facts.boundsMax, limit_);
    if (restart) {
        // Probes find their places, then many bounces by few rays, then means begin.
        updateProbes(context, shared::kProbeUpdateRestart);
        for (uint32_t i = 0; i < kPlacingRounds; ++i) updateProbes(context, shared::kProbeUpdateMoved);
        for (int64_t bounce = context.params.getInt("ddgi.bounces"); bounce > 0; --bounce)
            updateProbes(context, shared::kProbeUpdateBounce);
        for (uint32_t i = 0; i < kFirstRounds; ++i) updateProbes(context, shared::kProbeUpdateActive);
    } else if (changed || !settled(context) || ++restFrames_ % restPeriod(context.params) == 0) {
        updateProbes(context, (changed ? shared::kProbeUpdateChanged : 0) | (relit ? shared::kProbeUpdateRelit : 0) |
                                  (roused ? shared::kProbeUpdateRoused : 0));
    }
    gather(context);
}

bool DdgiNode::settled(const graph::FrameContext& context) const {
    // An average of many frames is as good as what its probes know.
    return followFrames_ == 0 && context.sampleIndex == 0;
}

void DdgiNode::updateProbes(graph::FrameContext& context, uint32_t flags) {
    const auto& resources = context.resources;
    gpu::Commands& commands = context.commands;
    const double share =
        settled(context) ? restPeriod(context.params) * context.params.getFloat("ddgi.settledShare") : 1.0;
    const auto budget = static_cast<uint32_t>(share * static_cast<double>(context.params.getInt("ddgi.budget")));
    const uint32_t probes = grid_.probes();
    const auto spared = [&](uint32_t rays) {
        return std::clamp(rays * kFirstProbes / probes & ~3u, std::min(kFewestRays, rays), rays);
    };
    uint32_t rays = raysPerProbe_;
    if ((flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateMoved)) != 0)
        rays = kPlacingRays;
    else if ((flags & shared::kProbeUpdateBounce) != 0)
        rays = spared(kBounceRays);
    else if ((flags & shared::kProbeUpdateActive) != 0)
        rays = spared(raysPerProbe_);
    const bool wakes = (flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateChanged)) != 0;
    const bool turns =
        (flags & ~(shared::kProbeUpdateChanged | shared::kProbeUpdateRelit | shared::kProbeUpdateRoused)) == 0;

    shared::ProbeBeginPush begin{};
    begin.frame = context.frame;
    begin.volume = resources.address(volume_);
    begin.probes = resources.address(probes_);
    begin.irradiance = resources.address(irradiance_);
    begin.distances = resources.address(distances_);
    begin.origin = grid_.origin;
    begin.spacing = grid_.spacing();
    begin.steps = grid_.steps;
    begin.counts = grid_.counts;
    begin.rays = std::min(rays, raysPerProbe_);
    begin.fewest = relitFrames_ > 0 ? std::min(kFewestRays, raysPerProbe_) : begin.rays;
    begin.budget = turns ? std::max(budget, 1u) : 0;
    begin.waking = (flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateRoused)) != 0 ? 1 : 0;
    commands.dispatch(context.pipeline({"passes/ddgi/begin.comp", {}, {}}), begin, 1);
    commands.barrier();

    shared::ProbeUpdatePush update{};
    update.frame = context.frame;
    update.volume = begin.volume;
    update.turns = resources.address(turns_);
    update.rays = resources.address(rays_);
    update.causticCache = resources.address(causticCache_);
    update.rayCount = (flags & shared::kProbeUpdateActive) != 0 ? raysPerProbe_ : begin.rays;
    update.flags = flags;
    update.tolerance = static_cast<float>(context.params.getFloat("ddgi.tolerance"));
    // Groups find the number of probes on the device; those beyond it end at once, and should there be more, they loop.
    const uint32_t expected = turns ? std::min(probes, 2 * budget / begin.fewest + probes / 16 + 1) : probes;
    if (wakes) {
        commands.dispatch(context.pipeline({"passes/ddgi/wake.comp", {}, {}}), update, probes);
        commands.barrier();
    }
    commands.dispatch(context.pipeline({"passes/ddgi/select.comp", {}, {}}), update, probes);
    commands.barrier();
    const auto run = [&](const char* pass, uint32_t threads, std::vector<std::pair<std::string, std::string>> defines) {
        const std::string path = std::string("passes/ddgi/") + pass + ".comp";
        commands.dispatch(context.pipeline({path, std::move(defines), {}}), update, graph::spread(threads));
        commands.barrier();
    };
    run("trace", expected * begin.rays, {{"TL_CAUSTIC_CACHE", causticCache_ ? "1" : "0"}});
    run("judge", expected, {});
    run("blend", expected * shared::kSpreadGroupSize, {});
}

void DdgiNode::gather(graph::FrameContext& context) {
    const auto& resources = context.resources;
    const graph::SceneFacts& facts = context.facts;
    gpu::Commands& commands = context.commands;
    shared::ProbeGatherPush push{};
    push.frame = context.frame;
    push.points = resources.address(points_);
    push.volume = resources.address(volume_);
    push.causticCache = resources.address(causticCache_);
    push.indirect = resources.address(indirect_);
    push.lookups = resources.address(lookups_);
    push.turn = shared::kNone;
    if (lookups_) {
        const bool still = context.repeats || !(facts.sceneChanged || facts.cameraMoved);
        const bool standing = still && settled(context) && resources.historyValid(lookups_);
        if (standing) push.turn = standingFrames_++ % shared::kLookupTurns;
        const uint32_t columns = (context.width + shared::kLookupColumns - 1) / shared::kLookupColumns;
        const uint32_t rows = (context.height + shared::kLookupRows - 1) / shared::kLookupRows;
        commands.dispatch(context.pipeline({"passes/ddgi/gather.comp", {}, {}}), push, columns, rows);
        if (!facts.rough) return;
        commands.barrier();
    }
    const char* final = lookups_ ? "0" : "1";
    commands.dispatch(context.pipeline({"passes/ddgi/gather_rays.comp",
                                        {{"TL_FINAL", final}, {"TL_CAUSTIC_CACHE", causticCache_ ? "1" : "0"}},
                                        {}}),
                      push, context.width, context.height);
}

} // namespace trilume
