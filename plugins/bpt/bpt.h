#pragma once

#include "graph/graph.h"

namespace trilume {

/// Bidirectional path tracing from the visible points and the lights; see README.md. Creates `bpt.direct`,
/// `bpt.caustic` and `bpt.indirect` (vec3 each).
class BptNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane points_, reservoirs_, direct_, caustic_, indirect_, vertexCounts_, splats_;
    graph::Buffer vertices_;
};

} // namespace trilume
