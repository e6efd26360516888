#pragma once

#include "graph/graph.h"

namespace trilume {

/// The averaged picture for a display; see README.md. Creates `post.display`: 32 bits a pixel, RGBA8, sRGB-encoded.
class PostNode final : public graph::Node {
public:
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane sums_, display_;
};

} // namespace trilume
