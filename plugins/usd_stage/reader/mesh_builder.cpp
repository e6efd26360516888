#include "mesh_builder.h"

#include "polygon.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace trilume::usd {
namespace {

bool isFinite(glm::vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool isFinite(glm::vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }

void report(Problems& problems, size_t count, const char* what) {
    if (count) problems.push_back({count, what});
}

/// Calls f(face, first corner, count) for each face whose corners are all there.
template<class F>
void eachFace(const PolygonMesh& m, F&& f) {
    size_t first = 0;
    for (size_t face = 0; face < m.counts.size(); ++face) {
        const int count = m.counts[face];
        if (count < 0 || first + static_cast<size_t>(count) > m.indices.size()) return;
        f(face, first, static_cast<size_t>(count));
        first += static_cast<size_t>(count);
    }
}

size_t elementCount(const PolygonMesh& m, Interpolation interpolation) {
    switch (interpolation) {
    case Interpolation::Constant:
        return 1;
    case Interpolation::Uniform:
        return m.counts.size();
    case Interpolation::FaceVarying:
        return m.indices.size();
    case Interpolation::Vertex:
    case Interpolation::Varying:
        break;
    }
    return m.points.size();
}

/// Whether every element of the mesh has a value.
template<class T>
bool isComplete(const PolygonMesh& m, const Primvar<T>& primvar) {
    const size_t elements = elementCount(m, primvar.interpolation);
    if (primvar.indices.empty()) return primvar.values.size() >= elements;
    const auto inRange = [&](int i) { return i >= 0 && static_cast<size_t>(i) < primvar.values.size(); };
    return primvar.indices.size() >= elements && std::all_of(primvar.indices.begin(), primvar.indices.end(), inRange);
}

/// Values by triangle corner.
template<class T>
std::vector<T> expand(const Primvar<T>& primvar, const Topology& topology) {
    std::vector<T> result(3 * topology.triangles.size());
    const auto fill = [&](auto element) {
        for (size_t t = 0; t < topology.triangles.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                const size_t e = element(t, k);
                result[3 * t + k] = primvar.values[primvar.indices.empty() ? e : primvar.indices[e]];
            }
    };
    switch (primvar.interpolation) {
    case Interpolation::Constant:
        fill([](size_t, int) { return size_t{0}; });
        break;
    case Interpolation::Uniform:
        fill([&](size_t t, int) { return topology.faces[t]; });
        break;
    case Interpolation::FaceVarying:
        fill([&](size_t t, int k) { return topology.corners[t][k]; });
        break;
    case Interpolation::Vertex:
    case Interpolation::Varying:
        fill([&](size_t t, int k) { return topology.triangles[t][k]; });
        break;
    }
    return result;
}

glm::vec3 triangleNormal(const Mesh& mesh, size_t triangle) {
    const glm::uvec3 v = mesh.triangles[triangle];
    const glm::dvec3 a = mesh.positions[v.x], b = mesh.positions[v.y], c = mesh.positions[v.z];
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double length = glm::length(n);
    return length > 0 ? glm::vec3(n / length) : glm::vec3(0, 0, 1);
}

/// Unit normals; those without direction become the triangle's. Returns how many had none.
size_t normalize(std::vector<glm::vec3>& normals, const Mesh& mesh) {
    size_t bad = 0;
    for (size_t i = 0; i < normals.size(); ++i) {
        const double length = glm::length(glm::dvec3(normals[i]));
        if (length > 0 && std::isfinite(length)) {
            normals[i] = glm::vec3(glm::dvec3(normals[i]) / length);
        } else {
            normals[i] = triangleNormal(mesh, i / 3);
            ++bad;
        }
    }
    return bad;
}

/// Per vertex the sum of its faces' vector areas: faces, not triangles, so that the choice of diagonals doesn't show.
std::vector<glm::vec3> smoothNormals(const PolygonMesh& m, const Topology& topology, const Mesh& mesh) {
    std::vector<bool> used(m.counts.size());
    for (uint32_t face : topology.faces) used[face] = true;
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0));
    std::vector<glm::vec3> corners;
    eachFace(m, [&](size_t face, size_t first, size_t count) {
        if (!used[face]) return;
        corners.clear();
        for (size_t i = first; i < first + count; ++i) corners.push_back(mesh.positions[m.indices[i]]);
        const glm::dvec3 area = vectorArea(corners) * (m.leftHanded ? -1.0 : 1.0);
        for (size_t i = first; i < first + count; ++i) sums[m.indices[i]] += area;
    });
    std::vector<glm::vec3> normals(3 * topology.triangles.size());
    for (size_t t = 0; t < topology.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            // Scaled here: the squares of small areas would vanish in single precision.
            const glm::dvec3 sum = sums[topology.triangles[t][k]];
            const double length = glm::length(sum);
            normals[3 * t + k] = length > 0 ? glm::vec3(sum / length) : glm::vec3(0);
        }
    return normals;
}

std::vector<glm::vec3> buildNormals(const PolygonMesh& m, const Topology& topology, const Mesh& mesh,
                                    Problems& problems) {
    std::vector<glm::vec3> normals;
    if (m.normals && isComplete(m, *m.normals)) {
        normals = expand(*m.normals, topology);
        report(problems, normalize(normals, mesh), "corners have normals without direction: faces' normals are used");
    } else {
        if (m.normals) problems.push_back({0, "normals do not match the mesh: left out"});
        if (!m.smooth) return {};
        normals = smoothNormals(m, topology, mesh);
        normalize(normals, mesh);
    }
    return normals;
}

std::vector<glm::vec2> buildUvs(const PolygonMesh& m, const Topology& topology, Problems& problems) {
    if (!m.uvs) return {};
    if (!isComplete(m, *m.uvs)) {
        problems.push_back({0, "texture coordinates do not match the mesh: left out"});
        return {};
    }
    std::vector<glm::vec2> uvs = expand(*m.uvs, topology);
    size_t bad = 0;
    for (glm::vec2& uv : uvs)
        if (!isFinite(uv)) {
            uv = glm::vec2(0);
            ++bad;
        }
    report(problems, bad, "corners have texture coordinates that are not finite: 0 is used");
    return uvs;
}

std::vector<uint32_t> buildSubsets(const PolygonMesh& m, const Topology& topology, Problems& problems) {
    if (m.subsets.empty()) return {};
    std::vector<uint32_t> subsetOfFace(m.counts.size(), 0);
    size_t bad = 0;
    for (size_t s = 0; s < m.subsets.size(); ++s)
        for (int face : m.subsets[s]) {
            if (face >= 0 && static_cast<size_t>(face) < subsetOfFace.size())
                subsetOfFace[face] = static_cast<uint32_t>(s + 1);
            else
                ++bad;
        }
    report(problems, bad, "indices of subsets name no face: left out");
    std::vector<uint32_t> subsets;
    subsets.reserve(topology.faces.size());
    for (uint32_t face : topology.faces) subsets.push_back(subsetOfFace[face]);
    return subsets;
}

/// Points that are not finite would spoil bounds: they take the place of one that is used.
void copyPoints(const PolygonMesh& m, const Topology& topology, Mesh& mesh) {
    mesh.positions.assign(m.points.begin(), m.points.end());
    if (topology.triangles.empty()) return;
    const glm::vec3 usable = m.points[topology.triangles.front().x];
    for (glm::vec3& p : mesh.positions)
        if (!isFinite(p)) p = usable;
}

bool hasArea(const PolygonMesh& m, glm::uvec3 v) {
    const glm::dvec3 a = m.points[v.x], b = m.points[v.y], c = m.points[v.z];
    const glm::dvec3 n = glm::cross(b - a, c - a);
    return n != glm::dvec3(0);
}

} // namespace

std::string Problem::text() const { return count ? fmt::format("{} {}", count, what) : std::string(what); }

Topology buildTopology(const PolygonMesh& m, Problems& problems) {
    Topology topology;
    topology.pointCount = m.points.size();
    topology.triangles.reserve(m.indices.size() / 2);
    topology.corners.reserve(m.indices.size() / 2);
    topology.faces.reserve(m.indices.size() / 2);

    std::vector<bool> hole(m.counts.size(), false);
    for (int face : m.holes)
        if (face >= 0 && static_cast<size_t>(face) < hole.size()) hole[face] = true;
    std::vector<bool> finite(m.points.size());
    for (size_t i = 0; i < m.points.size(); ++i) finite[i] = isFinite(m.points[i]);

    size_t tooFew = 0, outOfRange = 0, notFinite = 0, noArea = 0, read = 0, consumed = 0;
    std::vector<glm::vec3> corners;
    std::vector<std::array<uint32_t, 3>> triangles;
    eachFace(m, [&](size_t face, size_t first, size_t count) {
        ++read;
        consumed = first + count;
        if (hole[face]) return;
        if (count < 3) {
            ++tooFew;
            return;
        }
        corners.clear();
        bool usable = true;
        for (size_t i = first; i < first + count && usable; ++i) {
            const int index = m.indices[i];
            if (index < 0 || static_cast<size_t>(index) >= m.points.size()) {
                ++outOfRange;
                usable = false;
            } else if (!finite[index]) {
                ++notFinite;
                usable = false;
            } else {
                corners.push_back(m.points[index]);
            }
        }
        if (!usable) return;
        triangles.clear();
        triangulate(corners, triangles);
        for (auto [a, b, c] : triangles) {
            if (m.leftHanded) std::swap(b, c);
            const glm::uvec3 corner = glm::uvec3(a, b, c) + static_cast<uint32_t>(first);
            const glm::uvec3 v(m.indices[corner.x], m.indices[corner.y], m.indices[corner.z]);
            if (!m.deforming && !hasArea(m, v)) {
                ++noArea;
                continue;
            }
            topology.triangles.push_back(v);
            topology.corners.push_back(corner);
            topology.faces.push_back(static_cast<uint32_t>(face));
        }
    });
    report(problems, m.counts.size() - read, "faces have counts that do not fit the indices: left out");
    if (read == m.counts.size() && consumed < m.indices.size())
        problems.push_back({0, "there are more indices than the faces' corners: the rest is left out"});
    report(problems, tooFew, "faces have fewer than 3 corners: left out");
    report(problems, outOfRange, "faces have point indices out of range: left out");
    report(problems, notFinite, "faces have points that are not finite: left out");
    report(problems, noArea, "triangles have no area: left out");
    return topology;
}

void buildMesh(const PolygonMesh& m, const Topology& topology, Mesh& mesh, Problems& problems) {
    mesh.triangles = topology.triangles;
    mesh.deforming = m.deforming;
    copyPoints(m, topology, mesh);
    mesh.normals = buildNormals(m, topology, mesh, problems);
    mesh.uvs = buildUvs(m, topology, problems);
    mesh.triangleSubset = buildSubsets(m, topology, problems);
}

bool updatePoints(const PolygonMesh& m, const Topology& topology, Mesh& mesh, Problems& problems) {
    bool changed = false;
    for (size_t i = 0; i < m.points.size(); ++i)
        if (isFinite(m.points[i]) && m.points[i] != mesh.positions[i]) {
            mesh.positions[i] = m.points[i];
            changed = true;
        }
    if (!changed && !m.normals) return false;
    std::vector<glm::vec3> normals = buildNormals(m, topology, mesh, problems);
    changed |= normals != mesh.normals;
    mesh.normals = std::move(normals);
    return changed;
}

} // namespace trilume::usd
