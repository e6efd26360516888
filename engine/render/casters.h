#pragma once

#include "scene/components.h"
#include "shared/scene.h"

#include <span>
#include <vector>

namespace trilume {

/// In local space.
struct Ball {
    glm::dvec3 center{0};
    double radius = -1; ///< below 0: empty
};

/// Around each subset of a mesh: the centre of its box, out to its farthest finite point.
std::vector<Ball> ballsOfSubsets(const Mesh& mesh);

/// The ball around `balls` as `renderFromLocal` leaves them; not exact where that scales unevenly, but never too small.
shared::Caster placeCaster(std::span<const Ball> balls, const glm::dmat4x3& renderFromLocal);

/// At most shared::kMaxCasters balls around all of them, neighbours together. Empty and non-finite ones are left out.
std::vector<shared::Caster> groupCasters(std::vector<shared::Caster> casters);

} // namespace trilume
