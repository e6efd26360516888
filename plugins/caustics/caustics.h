#pragma once

#include "graph/graph.h"

namespace trilume {

/// Light through mirrors and glass onto rough surfaces, by photons; see README.md. Creates `caustics.caustic` (vec3)
/// and `caustics.cache` (shared::CausticPatch, shaders/scene/caustic_cache.glsl).
class CausticsNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane points_, previousPoints_, caustic_;
    graph::History<graph::Plane> mean_;
    graph::Buffer photons_, heads_, splats_, cache_, cacheSums_, cacheCounts_;
    graph::History<graph::Buffer> guide_, state_;
    uint32_t photonLimit_ = 0, cells_ = 0;
    double cachedFrames_ = 0;   ///< in the cache's mean
    uint32_t stillFrames_ = 0;  ///< remembered, since light, things, materials, parameters or the camera last changed
    uint32_t knownGroups_ = 0;  ///< of lights, in the guide
    uint32_t knownCasters_ = 0; ///< there
    uint64_t lighting_ = 0;     ///< SceneFacts::lightingRevision of the last frame
};

} // namespace trilume
