#pragma once

#include "graph/graph.h"

#include <algorithm>

namespace trilume {

/// A grid of probes that fits a box: planes of probes stand just inside its sides, and one more outside each.
struct ProbeGrid {
    glm::vec3 boundsMin{0}, boundsMax{0}; ///< that it fits
    glm::vec3 origin{0};                  ///< of the first probe, render space, metres
    glm::vec3 steps{1};                   ///< metres
    glm::uvec3 counts{0};
    float spacing() const { return std::max({steps.x, steps.y, steps.z}); }
    uint32_t probes() const { return counts.x * counts.y * counts.z; }
    /// Whether the box is no more than half a step outside the one that it was made for, and not much smaller.
    bool serves(glm::vec3 min, glm::vec3 max) const;
};
/// The finest of at most `limit` probes, 125 or more.
ProbeGrid fitProbeGrid(glm::vec3 boundsMin, glm::vec3 boundsMax, uint32_t limit);

/// Light of two or more bounces from irradiance probes; see README.md. Creates `ddgi.indirect` (vec3) and
/// `ddgi.volume` (shared::ProbeVolume), by which other nodes look probes up (shaders/scene/probes.glsl).
class DdgiNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    bool settled(const graph::FrameContext& context) const;
    /// One round; `flags`: shared::kProbeUpdate*.
    void updateProbes(graph::FrameContext& context, uint32_t flags);
    void gather(graph::FrameContext& context);

    graph::Plane points_, indirect_;
    graph::Buffer volume_, probes_, irradiance_, distances_, turns_, rays_, lookups_, causticCache_;
    ProbeGrid grid_;                ///< that the probes in memory stand on
    uint32_t limit_ = 0;            ///< probes that there is memory for
    uint64_t lightingRevision_ = 0; ///< that they have seen
    uint32_t raysPerProbe_ = 0;
    uint32_t relitFrames_ = 0;
    uint32_t restFrames_ = 0;     ///< in which probes rested or refined what they knew
    uint32_t standingFrames_ = 0; ///< in which pixels kept what they were told
    uint32_t followFrames_ = 0;   ///< for which they still follow a change
};

} // namespace trilume
