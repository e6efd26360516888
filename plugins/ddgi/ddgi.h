#pragma once

#include "graph/graph.h"
#include "shared/ddgi.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace trilume {

/// A grid of probes.
struct ProbeGrid {
    glm::vec3 boundsMin{0}, boundsMax{0}; ///< that it fits, if any
    glm::vec3 origin{0};                  ///< of the first probe, render space, metres
    glm::vec3 steps{1};                   ///< metres
    glm::uvec3 counts{0};
    glm::ivec3 first{0};  ///< of a grid that follows a place, the first probe in steps from the origin of render space
    glm::uvec3 scroll{0}; ///< where that probe stands in memory, which wraps around along each axis
    float spacing() const { return std::max({steps.x, steps.y, steps.z}); }
    uint32_t probes() const { return counts.x * counts.y * counts.z; }
    /// Whether the box is no more than half a step outside the one that it was made for, and not much smaller.
    bool serves(glm::vec3 min, glm::vec3 max) const;
};
/// The finest of at most `limit` probes, 125 or more, that fits a box: planes of probes stand just inside its sides,
/// and one more outside each.
ProbeGrid fitProbeGrid(glm::vec3 boundsMin, glm::vec3 boundsMax, uint32_t limit);
/// A cube of at most `limit` probes about a place, at multiples of `spacing`.
ProbeGrid probeGridAround(glm::vec3 place, float spacing, uint32_t limit);
/// Moves such a grid along with its place. Returns by how many probes: none while the place is within a step and a half
/// of the middle, so that one who walks to and fro does not move it each time.
glm::ivec3 followPlace(ProbeGrid& grid, glm::vec3 place);

/// Light of two or more bounces from irradiance probes; see README.md. Creates `ddgi.indirect` (vec3) and
/// `ddgi.volumes` (shared::ProbeVolume), by which other nodes look probes up (shaders/scene/probes.glsl).
class DdgiNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    uint32_t probes() const;                  ///< of all volumes
    uint32_t photonRays(uint32_t rays) const; ///< that a probe sends besides `rays` others
    bool settled(const graph::FrameContext& context) const;
    void restart(graph::FrameContext& context);
    /// Moves the finer volumes along with the camera; what they come to begins anew.
    void followCamera(graph::FrameContext& context);
    /// One round of a volume; `flags`: shared::kProbeUpdate*. `shift`: of its grid in this frame, in probes, when the
    /// round is of those that it came to.
    void updateProbes(graph::FrameContext& context, uint32_t volume, uint32_t flags, glm::ivec3 shift = glm::ivec3(0));
    void updateVolumes(graph::FrameContext& context, uint32_t flags);
    /// Raises the light of all probes to what all bounces would make of it, as the last round was tallied.
    void growVolumes(graph::FrameContext& context);
    /// `anew`: what pixels were told is of other light or other probes.
    void gather(graph::FrameContext& context, bool anew);
    std::pair<std::string, std::string> volumesDefine() const;
    std::pair<std::string, std::string> cacheDefine() const;

    graph::Plane points_, indirect_;
    graph::Buffer volumes_, probes_, irradiance_, distances_, turns_, rays_, causticCache_, photons_, causticState_;
    std::array<graph::Buffer, 2> lookups_;               ///< what pixels were told; null with ddgi.gather=final
    std::array<ProbeGrid, shared::kProbeVolumes> grids_; ///< that the probes in memory stand on
    uint32_t count_ = 0;                                 ///< of volumes
    uint32_t limit_ = 0;                                 ///< probes of a volume that there is memory for
    uint64_t lightingRevision_ = 0;                      ///< that they have seen
    uint32_t raysPerProbe_ = 0;
    uint32_t relitFrames_ = 0;
    uint32_t restFrames_ = 0;     ///< in which probes rested or refined what they knew
    uint32_t lookupFrames_ = 0;   ///< in which pixels kept what they were told
    uint32_t lookupSide_ = 0;     ///< the latest of lookups_; the other: before the camera moved
    uint32_t followFrames_ = 0;   ///< for which they still follow a change
    uint32_t scrolledFrames_ = 0; ///< for which they learn about places that a volume has come to
};

} // namespace trilume
