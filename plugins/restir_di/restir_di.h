#pragma once

#include "graph/graph.h"

namespace trilume {

/// Direct light by spatiotemporal reservoir resampling; see README.md. Creates `restir_di.direct` (vec3) and, with
/// reuse, the history `restir_di.reservoirs` (shared::Reservoir).
class RestirDiNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    enum class Reuse { Off, Temporal, Spatiotemporal };
    struct Choice {
        Reuse reuse;
        const char* reason;
    };
    void learn(graph::FrameContext& context, bool restart) const;
    static Choice choose(const graph::SceneFacts& facts, const ParamSet& params);

    Reuse reuse_ = Reuse::Off;
    graph::Plane points_, previousPoints_, direct_, merged_, neighbors_, chosen_;
    graph::Buffer tiles_;
    graph::History<graph::Plane> reservoirs_;
};

} // namespace trilume
