#pragma once

#include "graph/graph.h"

#include <vector>

namespace trilume {

/// Sums every plane that ends in a path class's name and averages over frames; see README.md. Creates `composite.color`
/// (vec3, this frame), `composite.sums` (shared::PixelSums) and `composite.aov.<name>` (float sums) for each AOV asked
/// for.
class CompositeNode final : public graph::Node {
public:
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    struct AovSum {
        std::vector<graph::Plane> values; ///< several where path classes overlap
        graph::History<graph::Plane> sum;
        uint32_t channels;
    };
    std::vector<graph::Plane> signals_;
    graph::Plane color_;
    graph::History<graph::Plane> sums_;
    std::vector<AovSum> aovs_;
};

} // namespace trilume
