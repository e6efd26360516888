#pragma once

#include <array>
#include <cstddef>

namespace trilume {

/// Keeps frames within a time by the effort of those parameters that buy less noise with time (ParamRow::least).
///
/// It decides on the median of three frames of one effort, so that single slow frames move nothing, and only outside of
/// 0.8 to 1 times the target. Then it steps towards 0.9 times the target by the most that a frame's time can follow
/// effort (ParamSet::effortRange), as if all of it did: where less does, steps fall short, so that it arrives from one
/// side and does not swing.
class EffortGovernor {
public:
    explicit EffortGovernor(double targetMs) : targetMs_(targetMs) {}

    /// 0 to 1, of the next frame.
    double effort() const { return effort_; }
    /// The time of a frame that was rendered at effort(), with `range` as its effort range.
    void take(double ms, double range);

private:
    double targetMs_, effort_ = 1;
    std::array<double, 3> recent_{};
    size_t taken_ = 0;
};

} // namespace trilume
