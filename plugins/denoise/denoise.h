#pragma once

#include "graph/graph.h"
#include "shared/denoise.h"

#include <span>
#include <string>
#include <vector>

namespace trilume {

/// Temporal accumulation, and for each plane of direct, caustic and indirect light a variance-guided spatial filter;
/// the planes are replaced. See README.md.
class DenoiseNode final : public graph::Node {
public:
    graph::Need needed(const graph::SceneFacts& facts, const ParamSet& params) const override;
    void declare(graph::Builder& builder) override;
    void execute(graph::FrameContext& context) override;

private:
    struct Signal {
        graph::Plane plane; ///< before and after
        graph::History<graph::Plane> history;
    };
    static constexpr int64_t kNever = int64_t{1} << 32;

    uint32_t reproject(graph::FrameContext& context) const; ///< its flags
    void accumulateEmission(graph::FrameContext& context, bool changed);
    void accumulate(graph::FrameContext& context, std::span<const Signal> batch, uint32_t flags) const;
    void filter(graph::FrameContext& context, std::span<const Signal> batch) const;
    shared::DenoiseSumPush sumPush(const graph::FrameContext& context, std::span<const Signal> batch) const;

    graph::Plane points_, reprojection_;
    graph::Plane estimates_[2][shared::kDenoiseBatch]; ///< from and to of the filter, for each signal of a batch
    graph::History<graph::Plane> surfaces_;
    std::vector<Signal> signals_;
    graph::Plane emission_, emitters_; ///< null where nothing emits
    graph::History<graph::Plane> emissionHistory_;
    uint64_t lighting_ = 0;              ///< SceneFacts::lightingRevision of the last frame
    int64_t framesSinceChange_ = kNever; ///< of light
    int64_t framesAtRest_ = kNever;      ///< of scene and camera
};

} // namespace trilume
