#include "shapes.h"

#include <glm/gtc/constants.hpp>

#include <cmath>
#include <utility>
#include <vector>

namespace trilume::usd {
namespace {

constexpr uint32_t kSlices = 96; // around the axis
constexpr uint32_t kStacks = 24; // from a capsule's equator to its pole

/// Half plane of a surface of revolution: distance from the axis and height, with a normal in that plane.
struct ProfilePoint {
    double radius, height;
    glm::dvec2 normal;
};

/// From z up to `axis` up, by a rotation.
glm::vec3 orient(glm::dvec3 p, Axis axis) {
    switch (axis) {
    case Axis::X:
        return {p.z, p.x, p.y};
    case Axis::Y:
        return {p.y, p.z, p.x};
    case Axis::Z:
        break;
    }
    return p;
}

void clear(Mesh& mesh) {
    mesh.positions.clear();
    mesh.triangles.clear();
    mesh.normals.clear();
    mesh.uvs.clear();
}

void addCorner(Mesh& mesh, glm::vec3 normal, glm::dvec2 uv) {
    mesh.normals.push_back(normal);
    mesh.uvs.emplace_back(uv);
}

/// Turns a piece of profile, bottom to top with the outside to its right, around the axis. v runs from v0 to v1.
void revolve(const std::vector<ProfilePoint>& profile, double v0, double v1, Axis axis, Mesh& mesh) {
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    const auto direction = [](uint32_t slice) {
        const double angle = glm::two_pi<double>() * (slice % kSlices) / kSlices;
        return glm::dvec2(std::cos(angle), std::sin(angle));
    };
    for (const ProfilePoint& p : profile)
        for (uint32_t s = 0; s < kSlices; ++s) {
            const glm::dvec2 d = direction(s) * p.radius;
            mesh.positions.push_back(orient({d.x, d.y, p.height}, axis));
        }
    const auto rings = static_cast<uint32_t>(profile.size());
    const auto corner = [&](uint32_t ring, uint32_t slice) {
        const glm::dvec2 d = direction(slice) * profile[ring].normal.x;
        const double t = static_cast<double>(ring) / (rings - 1);
        addCorner(mesh, orient({d.x, d.y, profile[ring].normal.y}, axis),
                  {static_cast<double>(slice) / kSlices, v0 + t * (v1 - v0)});
        return base + ring * kSlices + slice % kSlices;
    };
    for (uint32_t ring = 0; ring + 1 < rings; ++ring)
        for (uint32_t s = 0; s < kSlices; ++s) {
            if (profile[ring].radius > 0)
                mesh.triangles.emplace_back(corner(ring, s), corner(ring, s + 1), corner(ring + 1, s + 1));
            if (profile[ring + 1].radius > 0)
                mesh.triangles.emplace_back(corner(ring, s), corner(ring + 1, s + 1), corner(ring + 1, s));
        }
}

void addQuad(Mesh& mesh, const glm::vec3 (&points)[4]) {
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    const glm::vec3 normal = glm::normalize(glm::cross(points[1] - points[0], points[3] - points[0]));
    const glm::dvec2 uvs[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (const glm::vec3& p : points) mesh.positions.push_back(p);
    for (const auto& [a, b, c] : {glm::uvec3(0, 1, 2), glm::uvec3(0, 2, 3)}) {
        mesh.triangles.emplace_back(base + a, base + b, base + c);
        for (uint32_t k : {a, b, c}) addCorner(mesh, normal, uvs[k]);
    }
}

} // namespace

void buildCube(double size, Mesh& mesh) {
    clear(mesh);
    const auto h = static_cast<float>(0.5 * size);
    for (Axis axis : {Axis::X, Axis::Y, Axis::Z}) {
        const auto at = [&](float x, float y, float z) { return orient({x, y, z}, axis); };
        addQuad(mesh, {at(-h, -h, h), at(h, -h, h), at(h, h, h), at(-h, h, h)});
        addQuad(mesh, {at(h, -h, -h), at(-h, -h, -h), at(-h, h, -h), at(h, h, -h)});
    }
}

void buildPlane(double width, double length, Axis axis, Mesh& mesh) {
    clear(mesh);
    const auto w = static_cast<float>(0.5 * width), l = static_cast<float>(0.5 * length);
    const auto at = [&](float u, float v) -> glm::vec3 {
        switch (axis) {
        case Axis::X:
            return {0, v, -u};
        case Axis::Y:
            return {u, 0, -v};
        case Axis::Z:
            break;
        }
        return {u, v, 0};
    };
    addQuad(mesh, {at(-w, -l), at(w, -l), at(w, l), at(-w, l)});
}

void buildCylinder(double radiusBottom, double radiusTop, double height, Axis axis, Mesh& mesh) {
    clear(mesh);
    const double h = 0.5 * height;
    const glm::dvec2 side = glm::normalize(glm::dvec2(height, radiusBottom - radiusTop));
    revolve({{radiusBottom, -h, side}, {radiusTop, h, side}}, 0, 1, axis, mesh);
    if (radiusBottom > 0) revolve({{0, -h, {0, -1}}, {radiusBottom, -h, {0, -1}}}, 0, 1, axis, mesh);
    if (radiusTop > 0) revolve({{radiusTop, h, {0, 1}}, {0, h, {0, 1}}}, 0, 1, axis, mesh);
}

void buildCapsule(double radiusBottom, double radiusTop, double height, Axis axis, Mesh& mesh) {
    clear(mesh);
    std::vector<ProfilePoint> profile;
    const auto addCap = [&](double radius, double centre, double from, double to) {
        for (uint32_t i = 0; i <= kStacks; ++i) {
            const double angle = from + (to - from) * i / kStacks;
            const bool pole = std::abs(angle) == glm::half_pi<double>();
            const glm::dvec2 n(pole ? 0 : std::cos(angle), std::sin(angle));
            profile.push_back({radius * n.x, centre + radius * n.y, n});
        }
    };
    addCap(radiusBottom, -0.5 * height, -glm::half_pi<double>(), 0);
    addCap(radiusTop, 0.5 * height, 0, glm::half_pi<double>());
    revolve(profile, 0, 1, axis, mesh);
}

} // namespace trilume::usd
