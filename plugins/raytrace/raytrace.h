#pragma once

#include "graph/graph.h"

namespace trilume {

/// Direct light by one light sample per pixel; see README.md. Creates `raytrace.direct` (vec3).
class RaytraceNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane points_, direct_;
};

} // namespace trilume
