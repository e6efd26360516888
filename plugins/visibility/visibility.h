#pragma once

#include "graph/graph.h"

namespace trilume {

/// Camera rays, followed through delta lobes; see README.md. Creates
/// `visibility.points` (shared::VisiblePoint, with last frame's), `visibility.emission` (vec3), for the denoiser
/// `visibility.emitters` (shared::VisibleEmitter) and, when an AOV or an image filter wants them, `visibility.albedo`
/// (vec3), `.normal` (vec3, world), `.depth` (float, metres), `.motion` (vec2, pixels).
class VisibilityNode final : public graph::Node {
public:
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    graph::Plane points_, emission_, emitters_, albedo_, normal_, depth_, motion_;
};

} // namespace trilume
