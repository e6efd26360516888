#include "polygon.h"

#include <cmath>

namespace trilume::usd {
namespace {

/// Twice the signed area of a triangle.
double cross(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// The corners without the coordinate along which the polygon is thinnest, counter-clockwise.
std::vector<glm::dvec2> project(std::span<const glm::vec3> corners) {
    const glm::dvec3 n = vectorArea(corners);
    const glm::dvec3 size = glm::abs(n);
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (n[axis] < 0) std::swap(u, v);
    std::vector<glm::dvec2> flat;
    flat.reserve(corners.size());
    for (const glm::vec3& p : corners) flat.emplace_back(p[u], p[v]);
    return flat;
}

bool isConvex(std::span<const glm::dvec2> p) {
    const size_t n = p.size();
    for (size_t i = 0; i < n; ++i)
        if (cross(p[i], p[(i + 1) % n], p[(i + 2) % n]) < 0) return false;
    return true;
}

/// Clips ears from a ring of corners: a corner whose triangle turns left and holds no other corner.
class EarClipper {
public:
    explicit EarClipper(std::span<const glm::dvec2> points)
        : points_(points), next_(points.size()), previous_(points.size()) {
        const auto n = static_cast<uint32_t>(points.size());
        for (uint32_t i = 0; i < n; ++i) {
            next_[i] = (i + 1) % n;
            previous_[i] = (i + n - 1) % n;
        }
    }

    void clip(std::vector<std::array<uint32_t, 3>>& triangles) {
        size_t left = points_.size();
        uint32_t corner = 0;
        for (size_t failures = 0; left > 3;) {
            // After a round without an ear (touching or crossing edges) any corner is taken, so that it ends.
            if (failures < left && !isEar(corner)) {
                corner = next_[corner];
                ++failures;
                continue;
            }
            triangles.push_back({previous_[corner], corner, next_[corner]});
            next_[previous_[corner]] = next_[corner];
            previous_[next_[corner]] = previous_[corner];
            corner = next_[next_[corner]]; // going on from here would make a fan of slivers
            --left;
            failures = 0;
        }
        triangles.push_back({previous_[corner], corner, next_[corner]});
    }

private:
    bool isEar(uint32_t corner) const {
        const glm::dvec2 a = points_[previous_[corner]], b = points_[corner], c = points_[next_[corner]];
        if (cross(a, b, c) <= 0) return false;
        for (uint32_t i = next_[next_[corner]]; i != previous_[corner]; i = next_[i]) {
            const glm::dvec2 p = points_[i];
            if (p == a || p == b || p == c) continue; // seams of polygons with bridged holes
            if (cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0) return false;
        }
        return true;
    }

    std::span<const glm::dvec2> points_;
    std::vector<uint32_t> next_, previous_;
};

} // namespace

glm::dvec3 vectorArea(std::span<const glm::vec3> corners) {
    const glm::dvec3 origin = corners.front();
    glm::dvec3 sum(0);
    for (size_t i = 2; i < corners.size(); ++i)
        sum += glm::cross(glm::dvec3(corners[i - 1]) - origin, glm::dvec3(corners[i]) - origin);
    return sum;
}

void triangulate(std::span<const glm::vec3> corners, std::vector<std::array<uint32_t, 3>>& triangles) {
    const auto n = static_cast<uint32_t>(corners.size());
    if (n == 3) {
        triangles.push_back({0, 1, 2});
        return;
    }
    const std::vector<glm::dvec2> flat = project(corners);
    if (!isConvex(flat)) {
        EarClipper(flat).clip(triangles);
        return;
    }
    for (uint32_t i = 2; i < n; ++i) triangles.push_back({0, i - 1, i});
}

} // namespace trilume::usd
