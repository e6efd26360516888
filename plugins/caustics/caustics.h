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
    graph::Plane points_, previousPoints_, caustic_, splats_;
    graph::History<graph::Plane> mean_;
    graph::Buffer photons_, heads_, cacheSums_;
    graph::History<graph::Buffer> guide_, state_, cache_;
    uint32_t photonLimit_ = 0, cells_ = 0;
    uint32_t cachedFrames_ = 0; ///< in the cache's mean
    uint64_t lighting_ = 0;     ///< SceneFacts::lightingRevision of the last frame
};

} // namespace trilume
