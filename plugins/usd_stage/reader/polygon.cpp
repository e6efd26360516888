#include "polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Some of the points, none at first, by the cell of a square grid that they lie in.
class Grid {
public:
    explicit Grid(std::span<const glm::dvec2> points)
        : side_(points.size() < 64 ? 1 : static_cast<size_t>(std::sqrt(points.size()))), origin_(points.front()) {
        glm::dvec2 end = origin_;
        for (glm::dvec2 p : points) {
            origin_ = glm::min(origin_, p);
            end = glm::max(end, p);
        }
        const glm::dvec2 size = end - origin_;
        for (int k = 0; k < 2; ++k) scale_[k] = size[k] > 0 ? static_cast<double>(side_) / size[k] : 0;
        first_.resize(side_ * side_ + 1);
        cell_.reserve(points.size());
        for (glm::dvec2 p : points) {
            const glm::dvec2 at = (p - origin_) * scale_;
            cell_.push_back(static_cast<uint32_t>(index(at.y) * side_ + index(at.x)));
            ++first_[cell_.back() + 1];
        }
        for (size_t cell = 0; cell < side_ * side_; ++cell) first_[cell + 1] += first_[cell];
        end_.assign(first_.begin(), first_.end() - 1);
        std::vector<uint32_t> next = end_;
        points_.resize(points.size());
        for (uint32_t i = 0; i < points.size(); ++i) {
            slot_.push_back(next[cell_[i]]++);
            points_[slot_[i]] = i;
        }
    }

    void set(uint32_t point, bool present) {
        uint32_t& end = end_[cell_[point]];
        if (present == (slot_[point] < end)) return;
        const uint32_t from = slot_[point], to = present ? end++ : --end, other = points_[to];
        std::swap(points_[from], points_[to]);
        slot_[point] = to;
        slot_[other] = from;
    }

    /// Calls f(point) for those in the cells that the triangle touches, until it is true.
    template<class F>
    bool any(std::array<glm::dvec2, 3> triangle, F&& f) const {
        for (glm::dvec2& p : triangle) p = (p - origin_) * scale_;
        const auto [low, high] = std::minmax({triangle[0].y, triangle[1].y, triangle[2].y});
        for (size_t row = index(low - kMargin); row <= index(high + kMargin); ++row) {
            const auto [left, right] = extent(triangle, static_cast<double>(row));
            for (size_t cell = row * side_ + index(left); cell <= row * side_ + index(right); ++cell)
                for (uint32_t i = first_[cell]; i < end_[cell]; ++i)
                    if (f(points_[i])) return true;
        }
        return false;
    }

private:
    static constexpr double kMargin = 1e-6; // of a cell, for rounding

    size_t index(double x) const { return static_cast<size_t>(std::clamp(x, 0.0, static_cast<double>(side_ - 1))); }
    /// From left to right within a row: long thin triangles touch few cells of their bounds.
    static std::pair<double, double> extent(const std::array<glm::dvec2, 3>& triangle, double row) {
        const double low = row - kMargin, high = row + 1 + kMargin;
        double left = std::numeric_limits<double>::infinity(), right = -left;
        for (int k = 0; k < 3; ++k) {
            const glm::dvec2 p = triangle[k], q = triangle[(k + 1) % 3];
            if (std::max(p.y, q.y) < low || std::min(p.y, q.y) > high) continue;
            for (const glm::dvec2& end : {p, q}) {
                const double y = std::clamp(end.y, low, high);
                const double x = y == end.y ? end.x : p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
                left = std::min(left, x - kMargin);
                right = std::max(right, x + kMargin);
            }
        }
        return {left, right};
    }

    size_t side_;
    glm::dvec2 origin_, scale_{0};
    std::vector<uint32_t> points_, first_, end_; ///< of each cell, from first to end; those that are out stand behind
    std::vector<uint32_t> cell_, slot_;          ///< of each point
};

/// Clips ears from a ring of corners: a corner whose triangle turns left and holds no other corner. If it holds any, it
/// holds one that doesn't turn left: only those are looked at.
class EarClipper {
public:
    explicit EarClipper(std::span<const glm::dvec2> points)
        : points_(points), next_(points.size()), previous_(points.size()), place_(points.size()), reflex_(points) {
        const auto n = static_cast<uint32_t>(points.size());
        for (uint32_t i = 0; i < n; ++i) {
            next_[i] = (i + 1) % n;
            previous_[i] = (i + n - 1) % n;
        }
        for (uint32_t i = 0; i < n; ++i) reflex_.set(i, turn(i) <= 0);
    }

    void clip(std::vector<std::array<uint32_t, 3>>& triangles) {
        size_t left = points_.size();
        uint32_t corner = 0;
        bool changed = true;
        for (int rounds = 0; left > 3;) {
            if (head_ < queue_.size()) {
                const uint32_t candidate = queue_[head_];
                if (place_[candidate] != head_++ || !isEar(candidate)) continue;
                corner = candidate;
            } else if (changed && rounds < kMostRounds) {
                ++rounds;
                changed = false;
                for (size_t i = 0; i < left; ++i, corner = next_[corner]) enqueue(corner);
                continue;
            } // else there is none (touching or crossing edges): any corner is taken, so that it ends
            triangles.push_back({previous_[corner], corner, next_[corner]});
            corner = remove(corner);
            changed = true;
            --left;
        }
        triangles.push_back({previous_[corner], corner, next_[corner]});
    }

private:
    static constexpr int kMostRounds = 32; // over all corners; one is enough for a simple polygon

    /// To be looked at after all others: going on beside an ear would make a fan of slivers.
    void enqueue(uint32_t corner) {
        place_[corner] = queue_.size();
        queue_.push_back(corner);
    }

    /// Only its neighbours can become ears by that (Eberly, Triangulation by Ear Clipping). Returns one of them.
    uint32_t remove(uint32_t corner) {
        const uint32_t before = previous_[corner], behind = next_[corner];
        next_[before] = behind;
        previous_[behind] = before;
        reflex_.set(corner, false);
        for (uint32_t neighbour : {before, behind}) {
            reflex_.set(neighbour, turn(neighbour) <= 0);
            enqueue(neighbour);
        }
        return behind;
    }

    double turn(uint32_t corner) const {
        return cross(points_[previous_[corner]], points_[corner], points_[next_[corner]]);
    }

    bool isEar(uint32_t corner) const {
        if (turn(corner) <= 0) return false;
        const glm::dvec2 a = points_[previous_[corner]], b = points_[corner], c = points_[next_[corner]];
        return !reflex_.any({a, b, c}, [&](uint32_t i) {
            const glm::dvec2 p = points_[i];
            if (p == a || p == b || p == c) return false; // seams of polygons with bridged holes
            return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
        });
    }

    std::span<const glm::dvec2> points_;
    std::vector<uint32_t> next_, previous_;
    std::vector<uint32_t> queue_; ///< corners that may be ears
    size_t head_ = 0;
    std::vector<size_t> place_; ///< of each corner, its last one in the queue
    Grid reflex_;
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
