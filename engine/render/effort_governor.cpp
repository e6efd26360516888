#include "render/effort_governor.h"

#include <algorithm>
#include <cmath>

namespace trilume {

void EffortGovernor::take(double ms, double range) {
    if (!(ms > 0) || !(range > 0)) return;
    recent_[taken_++] = ms;
    if (taken_ < recent_.size()) return;
    taken_ = 0;
    std::ranges::sort(recent_);
    const double load = recent_[1] / targetMs_;
    if (load < 0.8 || load > 1) effort_ = std::clamp(effort_ + std::log(0.9 / load) / range, 0.0, 1.0);
}

} // namespace trilume
