#pragma once

#include "graph/graph.h"

namespace trilume {

/// Unbiased path tracing from the visible points; see README.md. Creates `pathtrace.direct`, `pathtrace.caustic` and
/// `pathtrace.indirect` (vec3 each).
class PathtraceNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane points_, direct_, caustic_, indirect_;
};

} // namespace trilume
