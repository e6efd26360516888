#pragma once

#include <glm/glm.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace trilume::usd {

/// Twice the vector area of a polygon (Newell): its normal, whatever its shape. Double precision.
glm::dvec3 vectorArea(std::span<const glm::vec3> corners);

/// Splits a simple polygon of at least 3 corners, convex or not, planar or nearly, into corners.size() - 2 triangles of
/// the same winding; each is three numbers of corners. Self-intersecting polygons give triangles too, without meaning.
void triangulate(std::span<const glm::vec3> corners, std::vector<std::array<uint32_t, 3>>& triangles);

} // namespace trilume::usd
