#include "ddgi.h"

#include <algorithm>
#include <cmath>

namespace trilume {

namespace {

constexpr uint32_t kPlacingRays = 32;
constexpr uint32_t kBounceRays = 16;
constexpr uint32_t kFirstProbes = 4096;  // beyond which the first frame's rounds spare rays
constexpr uint32_t kFewestRays = 8;      // of a probe that spares them
constexpr uint32_t kPlacingRounds = 4;   // a probe in a corner leaves it through three walls
constexpr uint32_t kFirstRounds = 3;     // of means, in the first frame
constexpr uint32_t kScrolledBounces = 4; // of probes that a volume has just come to: their neighbours know the others
constexpr uint32_t kScrolledRounds = 2;  // of their means
constexpr uint32_t kScrolledFrames = 8;  // for which they get the whole budget
constexpr float kRefinement = 4;         // of the spacing, from a volume to the next
constexpr uint32_t kRelitFrames = 16;    // after a change of the lights, in which probes spare rays for more turns
constexpr uint32_t kFollowFrames = 32;   // after a change of the scene, for which probes get the whole budget
constexpr uint32_t kAverageRays = 8192;  // in a frame of an average, or as many as pixels
constexpr double kRestPeriod = 8;        // frames of a scene that stands still, at most, of which one updates probes

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

constexpr float kFarthest = 1 << 22; // steps from the origin of render space, at which places are still told exactly

/// The first probe of a cube about a place, in steps.
glm::ivec3 firstAround(glm::vec3 place, float spacing, uint32_t side) {
    const glm::vec3 first = glm::round(place / spacing - 0.5f * static_cast<float>(side - 1));
    return glm::ivec3(glm::clamp(first, -kFarthest, kFarthest));
}

void standAt(ProbeGrid& grid, glm::ivec3 first) {
    const glm::ivec3 counts(grid.counts);
    grid.first = first;
    grid.origin = glm::vec3(first) * grid.steps;
    grid.scroll = glm::uvec3((first % counts + counts) % counts);
}

/// Where a scene is looked at.
glm::vec3 placeOfInterest(const graph::SceneFacts& facts) {
    return glm::clamp(facts.cameraPosition, facts.boundsMin, facts.boundsMax);
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

ProbeGrid probeGridAround(glm::vec3 place, float spacing, uint32_t limit) {
    uint32_t side = 2;
    while ((side + 1) * (side + 1) * (side + 1) <= limit) ++side;
    ProbeGrid grid{.steps = glm::vec3(spacing), .counts = glm::uvec3(side)};
    standAt(grid, firstAround(place, spacing, side));
    return grid;
}

glm::ivec3 followPlace(ProbeGrid& grid, glm::vec3 place) {
    const glm::ivec3 way = firstAround(place, grid.spacing(), grid.counts.x) - grid.first;
    const glm::ivec3 shift = glm::sign(way) * glm::max(glm::abs(way) - 1, 0);
    standAt(grid, grid.first + shift);
    return shift;
}

uint32_t DdgiNode::photonRays(uint32_t rays) const { return causticCache_ ? std::max(rays / 8, 1u) : 0; }

graph::Need DdgiNode::needed(const graph::SceneFacts& facts, const ParamSet& /*params*/) const {
    if (facts.lights == 0) return graph::Need::no("no lights");
    if (!facts.diffuseAlbedo) return graph::Need::no("nothing reflects diffusely");
    return graph::Need::yes();
}

void DdgiNode::declare(graph::Builder& builder) {
    limit_ = static_cast<uint32_t>(builder.params().getInt("ddgi.probes"));
    raysPerProbe_ = static_cast<uint32_t>(builder.params().getInt("ddgi.rays"));
    count_ = static_cast<uint32_t>(builder.params().getInt("ddgi.volumes"));
    const size_t probes = size_t{count_} * limit_;

    builder.owns(graph::PathClass::Indirect);
    points_ = builder.findPlane("visibility.points");
    builder.read(points_);
    causticCache_ = builder.findBuffer("caustics.cache");
    if (causticCache_) {
        builder.read(causticCache_);
        builder.read(photons_ = builder.findBuffer("caustics.photons"));
        builder.read(causticState_ = builder.findBuffer("caustics.state"));
    }
    volumes_ = builder.persistentBuffer("ddgi.volumes", count_ * sizeof(shared::ProbeVolume));
    probes_ = builder.persistentBuffer("ddgi.probes", probes * sizeof(shared::Probe));
    irradiance_ =
        builder.persistentBuffer("ddgi.irradiance", probes * shared::kProbeIrradianceNodes * sizeof(glm::vec3));
    distances_ = builder.persistentBuffer("ddgi.distances", probes * shared::kProbeDistanceNodes * sizeof(uint32_t));
    turns_ = builder.createBuffer("ddgi.turns", limit_ * sizeof(shared::ProbeTurn));
    rays_ = builder.createBuffer("ddgi.rays", size_t{limit_} * (raysPerProbe_ + photonRays(raysPerProbe_)) *
                                                  sizeof(shared::ProbeRay));
    indirect_ = builder.createPlane("ddgi.indirect", sizeof(glm::vec3));
    lookups_ = {};
    if (builder.params().getChoice("ddgi.gather") == "probe")
        for (size_t side = 0; side < lookups_.size(); ++side)
            lookups_[side] =
                builder.persistentBuffer("ddgi.lookups" + std::to_string(side),
                                         size_t{builder.width()} * builder.height() * sizeof(shared::ProbeLookup));
}

void DdgiNode::execute(graph::FrameContext& context) {
    const graph::SceneFacts& facts = context.facts;
    const bool fresh = !context.resources.historyValid(probes_);
    const bool restarts = fresh || !grids_[0].serves(facts.boundsMin, facts.boundsMax);
    const bool changed = lightingRevision_ != facts.lightingRevision;
    lightingRevision_ = facts.lightingRevision;
    const bool relit = changed && facts.changedLights > 0;
    const bool roused = changed && followFrames_ == 0;
    relitFrames_ = relit ? kRelitFrames : relitFrames_ - std::min(relitFrames_, 1u);
    scrolledFrames_ -= std::min(scrolledFrames_, 1u);
    if (restarts)
        followFrames_ = scrolledFrames_ = relitFrames_ = restFrames_ = lookupFrames_ = 0;
    else if (changed)
        followFrames_ = std::max(kFollowFrames * probes() / kFirstProbes, kFollowFrames);
    else if (followFrames_ > 0)
        --followFrames_;
    if (restarts) {
        grids_[0] = fresh ? fitProbeGrid(facts.boundsMin, facts.boundsMax, limit_)
                          : outgrown(grids_[0], facts.boundsMin, facts.boundsMax, limit_);
        restart(context);
    } else {
        followCamera(context);
        if (changed || !settled(context)) {
            updateVolumes(context, (changed ? shared::kProbeUpdateChanged : 0) |
                                       (relit ? shared::kProbeUpdateRelit : 0) |
                                       (roused ? shared::kProbeUpdateRoused : 0));
        } else if (const uint32_t period = restPeriod(context.params); ++restFrames_ % period == 0) {
            updateProbes(context, restFrames_ / period % count_, 0);
        }
    }
    gather(context, changed || restarts);
}

uint32_t DdgiNode::probes() const {
    uint32_t sum = 0;
    for (uint32_t volume = 0; volume < count_; ++volume) sum += grids_[volume].probes();
    return sum;
}

void DdgiNode::restart(graph::FrameContext& context) {
    for (uint32_t volume = 1; volume < count_; ++volume) {
        const float spacing = grids_[volume - 1].spacing() / kRefinement;
        grids_[volume] = probeGridAround(placeOfInterest(context.facts), spacing, limit_);
    }
    // Probes find their places, then many bounces by few rays, then means begin.
    updateVolumes(context, shared::kProbeUpdateRestart);
    for (uint32_t i = 1; i < kPlacingRounds; ++i) updateVolumes(context, shared::kProbeUpdateMoved);
    updateVolumes(context, shared::kProbeUpdateMoved | shared::kProbeUpdatePlaced);
    const int64_t bounces = context.params.getInt("ddgi.bounces"), half = bounces / 2;
    for (int64_t bounce = 0; bounce < bounces; ++bounce) {
        const bool tallied = half >= 2 && (bounce == half - 2 || bounce == half - 1);
        updateVolumes(context, shared::kProbeUpdateBounce | (tallied ? shared::kProbeUpdateTally : 0));
        if (half >= 2 && bounce == half - 1) growVolumes(context);
    }
    for (uint32_t i = 0; i < kFirstRounds; ++i) updateVolumes(context, shared::kProbeUpdateActive);
}

void DdgiNode::followCamera(graph::FrameContext& context) {
    for (uint32_t volume = 1; volume < count_; ++volume) {
        const glm::ivec3 shift = followPlace(grids_[volume], placeOfInterest(context.facts));
        if (shift == glm::ivec3(0)) continue;
        scrolledFrames_ = kScrolledFrames;
        const auto round = [&](uint32_t flags) { updateProbes(context, volume, flags, shift); };
        round(shared::kProbeUpdateScrolled | shared::kProbeUpdateMoved);
        round(shared::kProbeUpdateMoved | shared::kProbeUpdatePlaced);
        for (uint32_t i = 0; i < kScrolledBounces; ++i) round(shared::kProbeUpdateBounce | shared::kProbeUpdateFresh);
        for (uint32_t i = 0; i < kScrolledRounds; ++i) round(shared::kProbeUpdateFresh);
    }
}

void DdgiNode::updateVolumes(graph::FrameContext& context, uint32_t flags) {
    for (uint32_t volume = 0; volume < count_; ++volume) updateProbes(context, volume, flags);
}

void DdgiNode::growVolumes(graph::FrameContext& context) {
    for (uint32_t volume = 0; volume < count_; ++volume) {
        shared::ProbeUpdatePush push{};
        push.frame = context.frame;
        push.volume = context.resources.address(volumes_) + volume * sizeof(shared::ProbeVolume);
        context.commands.dispatch(context.pipeline({"passes/ddgi/grow.comp", {}, {}}), push,
                                  grids_[volume].probes() * shared::kProbeIrradianceNodes);
        context.commands.barrier();
    }
}

bool DdgiNode::settled(const graph::FrameContext& context) const {
    // An average of many frames is as good as what its probes know.
    return followFrames_ == 0 && scrolledFrames_ == 0 && context.sampleIndex == 0;
}

void DdgiNode::updateProbes(graph::FrameContext& context, uint32_t volume, uint32_t flags, glm::ivec3 shift) {
    const auto& resources = context.resources;
    gpu::Commands& commands = context.commands;
    const double share =
        settled(context) ? restPeriod(context.params) * context.params.getFloat("ddgi.settledShare") : 1.0 / count_;
    auto budget = static_cast<uint32_t>(share * static_cast<double>(context.params.getInt("ddgi.budget")));
    // Frames of an average are worth what they cost: of a small picture most of that would be probes.
    if (context.sampleIndex > 0 && followFrames_ == 0)
        budget = std::min(budget, std::max(kAverageRays, context.width * context.height));
    const ProbeGrid& grid = grids_[volume];
    const auto spared = [&](uint32_t rays) {
        return std::clamp(rays * kFirstProbes / grid.probes() & ~3u, std::min(kFewestRays, rays), rays);
    };
    const bool placing = (flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateMoved)) != 0;
    const bool bounce = (flags & shared::kProbeUpdateBounce) != 0;
    const bool begins = !bounce && (flags & (shared::kProbeUpdateActive | shared::kProbeUpdateFresh)) != 0;
    const bool turns = !placing && !bounce && !begins;
    uint32_t rays = raysPerProbe_;
    if (placing) rays = kPlacingRays;
    if (bounce) rays = spared(kBounceRays);
    if (begins) rays = spared(raysPerProbe_);
    const bool wakes =
        (flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateChanged | shared::kProbeUpdateScrolled)) != 0;
    const size_t first = size_t{volume} * limit_;

    shared::ProbeBeginPush begin{};
    begin.frame = context.frame;
    begin.volume = resources.address(volumes_) + volume * sizeof(shared::ProbeVolume);
    begin.probes = resources.address(probes_) + first * sizeof(shared::Probe);
    begin.irradiance = resources.address(irradiance_) + first * shared::kProbeIrradianceNodes * sizeof(glm::vec3);
    begin.distances = resources.address(distances_) + first * shared::kProbeDistanceNodes * sizeof(uint32_t);
    begin.origin = grid.origin;
    begin.spacing = grid.spacing();
    begin.steps = grid.steps;
    begin.counts = grid.counts;
    begin.scroll = grid.scroll;
    begin.rays = std::min(rays, raysPerProbe_);
    begin.fewest = relitFrames_ > 0 ? std::min(kFewestRays, raysPerProbe_) : begin.rays;
    begin.budget = turns ? std::max(budget, 1u) : 0;
    begin.waking = (flags & (shared::kProbeUpdateRestart | shared::kProbeUpdateRoused)) != 0 ? 1 : 0;
    commands.dispatch(context.pipeline({"passes/ddgi/begin.comp", {}, {}}), begin, 1);
    commands.barrier();

    shared::ProbeUpdatePush update{};
    update.frame = context.frame;
    update.volume = begin.volume;
    update.volumes = resources.address(volumes_);
    update.turns = resources.address(turns_);
    update.rays = resources.address(rays_);
    update.causticCache = resources.address(causticCache_);
    if (causticCache_) {
        update.photons = resources.address(photons_);
        update.causticState = resources.address(causticState_);
    }
    update.rayCount = begins ? raysPerProbe_ : begin.rays;
    update.flags = flags;
    update.shift = shift;
    update.firstProbe = static_cast<uint32_t>(first);
    update.tolerance = static_cast<float>(context.params.getFloat("ddgi.tolerance"));
    // Groups find the number of probes on the device; those beyond it end at once, and should there be more, they loop.
    const uint32_t all = grid.probes();
    uint32_t expected = all;
    if (turns) expected = std::min(all, 2 * budget / begin.fewest + all / 16 + 1);
    if (shift != glm::ivec3(0)) {
        const glm::uvec3 stay(glm::max(glm::ivec3(grid.counts) - glm::abs(shift), 0));
        expected = all - stay.x * stay.y * stay.z;
    }
    using Defines = std::vector<std::pair<std::string, std::string>>;
    const auto run = [&](std::string_view pass, uint32_t threads, Defines defines = {}) {
        const std::string path = "passes/ddgi/" + std::string(pass) + ".comp";
        commands.dispatch(context.pipeline({path, std::move(defines), {}}), update, threads);
        commands.barrier();
    };
    if (wakes) run("wake", all, {volumesDefine()});
    run("select", all);
    run("trace", graph::spread(expected * (begin.rays + photonRays(begin.rays))), {volumesDefine(), cacheDefine()});
    run("judge", graph::spread(expected), {cacheDefine()});
    if ((flags & shared::kProbeUpdateTally) != 0) run("tally", 1);
    run("blend", graph::spread(expected * shared::kSpreadGroupSize), {cacheDefine()});
}

void DdgiNode::gather(graph::FrameContext& context, bool anew) {
    const auto& resources = context.resources;
    const graph::SceneFacts& facts = context.facts;
    gpu::Commands& commands = context.commands;
    shared::ProbeGatherPush push{};
    push.frame = context.frame;
    push.points = resources.address(points_);
    push.volumes = resources.address(volumes_);
    push.causticCache = resources.address(causticCache_);
    push.indirect = resources.address(indirect_);
    push.turn = shared::kNone;
    const bool probes = static_cast<bool>(lookups_[0]);
    if (probes) {
        const bool moved = !context.repeats && facts.cameraMoved;
        // Of a texture, another place of the triangle tells nothing.
        const bool known =
            !anew && settled(context) && resources.historyValid(lookups_[0]) && !(moved && facts.textured);
        if (known) push.turn = lookupFrames_++ % shared::kLookupTurns;
        push.moved = known && moved ? 1 : 0;
        push.before = resources.address(lookups_[lookupSide_]);
        lookupSide_ ^= push.moved;
        push.lookups = resources.address(lookups_[lookupSide_]);
        const uint32_t columns = (context.width + shared::kLookupColumns - 1) / shared::kLookupColumns;
        const uint32_t rows = (context.height + shared::kLookupRows - 1) / shared::kLookupRows;
        commands.dispatch(context.pipeline({"passes/ddgi/gather.comp", {volumesDefine()}, {}}), push, columns, rows);
        if (!facts.rough) return;
        commands.barrier();
    }
    commands.dispatch(
        context.pipeline(
            {"passes/ddgi/gather_rays.comp", {{"TL_FINAL", probes ? "0" : "1"}, volumesDefine(), cacheDefine()}, {}}),
        push, context.width, context.height);
}

std::pair<std::string, std::string> DdgiNode::volumesDefine() const {
    return {"TL_PROBE_VOLUMES", std::to_string(count_)};
}

std::pair<std::string, std::string> DdgiNode::cacheDefine() const {
    return {"TL_CAUSTIC_CACHE", causticCache_ ? "1" : "0"};
}

} // namespace trilume
