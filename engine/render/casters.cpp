#include "render/casters.h"

#include <algorithm>
#include <cmath>

namespace trilume {

namespace {

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Ball around(Ball a, Ball b) {
    if (a.radius < b.radius) std::swap(a, b);
    if (b.radius < 0) return a;
    const double distance = glm::length(b.center - a.center);
    if (distance + b.radius <= a.radius) return a;
    const double radius = 0.5 * (distance + a.radius + b.radius);
    return {a.center + (b.center - a.center) * ((radius - a.radius) / distance), radius};
}

/// At least the largest factor by which a matrix stretches: Gershgorin's bound on M^T M, exact for scaled axes.
double stretch(const glm::dmat3& m) {
    const glm::dmat3 product = glm::transpose(m) * m;
    double largest = 0;
    for (int i = 0; i < 3; ++i)
        largest = std::max(largest, std::abs(product[i].x) + std::abs(product[i].y) + std::abs(product[i].z));
    return std::sqrt(largest);
}

Ball ballOf(const shared::Caster& c) { return {glm::dvec3(c.center), c.radius}; }

using Casters = std::span<shared::Caster>;

/// Splits at the median of the widest axis.
void group(Casters casters, size_t groups, std::vector<shared::Caster>& result) {
    if (groups == 1 || casters.size() <= 1) {
        Ball all;
        for (const shared::Caster& c : casters) all = around(all, ballOf(c));
        if (all.radius >= 0) result.push_back({glm::vec3(all.center), float(all.radius)});
        return;
    }
    glm::vec3 low(casters[0].center), high(low);
    for (const shared::Caster& c : casters) low = glm::min(low, c.center), high = glm::max(high, c.center);
    const glm::vec3 size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const size_t half = casters.size() / 2;
    std::nth_element(
        casters.begin(), casters.begin() + std::ptrdiff_t(half), casters.end(),
        [axis](const shared::Caster& a, const shared::Caster& b) { return a.center[axis] < b.center[axis]; });
    group(casters.subspan(0, half), groups / 2, result);
    group(casters.subspan(half), groups - groups / 2, result);
}

} // namespace

std::vector<Ball> ballsOfSubsets(const Mesh& mesh) {
    struct Box {
        glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
    };
    std::vector<Box> boxes(1);
    const auto eachPoint = [&mesh](const auto& visit) {
        for (size_t i = 0; i < mesh.triangles.size(); ++i) {
            const uint32_t subset = mesh.triangleSubset.empty() ? 0 : mesh.triangleSubset[i];
            for (int k = 0; k < 3; ++k) {
                if (mesh.triangles[i][k] >= mesh.positions.size()) continue;
                const glm::dvec3 p(mesh.positions[mesh.triangles[i][k]]);
                if (finite(p)) visit(subset, p);
            }
        }
    };
    eachPoint([&](uint32_t subset, glm::dvec3 p) {
        if (subset >= boxes.size()) boxes.resize(subset + 1);
        boxes[subset].low = glm::min(boxes[subset].low, p);
        boxes[subset].high = glm::max(boxes[subset].high, p);
    });
    std::vector<Ball> balls(boxes.size());
    eachPoint([&](uint32_t subset, glm::dvec3 p) {
        Ball& ball = balls[subset];
        ball.center = 0.5 * (boxes[subset].low + boxes[subset].high);
        ball.radius = std::max(ball.radius, glm::length(p - ball.center));
    });
    return balls;
}

shared::Caster placeCaster(std::span<const Ball> balls, const glm::dmat4x3& renderFromLocal) {
    Ball all;
    const double scale = stretch(glm::dmat3(renderFromLocal));
    for (const Ball& ball : balls)
        if (ball.radius >= 0) all = around(all, {renderFromLocal * glm::dvec4(ball.center, 1), scale * ball.radius});
    // Somewhat wider: what is aimed at the rim, where rounding decides what lies inside, misses.
    return {glm::vec3(all.center), float(all.radius * 1.001)};
}

std::vector<shared::Caster> groupCasters(std::vector<shared::Caster> casters) {
    std::erase_if(casters, [](const shared::Caster& c) {
        return !(c.radius > 0) || !std::isfinite(c.radius) || !finite(glm::dvec3(c.center));
    });
    if (casters.size() <= shared::kMaxCasters) return casters;
    std::vector<shared::Caster> result;
    group(casters, shared::kMaxCasters, result);
    return result;
}

} // namespace trilume
