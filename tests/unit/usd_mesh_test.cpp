#include "reader/mesh_builder.h"
#include "reader/polygon.h"
#include "reader/shapes.h"

#include <glm/gtc/constants.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <limits>
#include <random>

namespace trilume::usd {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

double areaOf(std::span<const glm::vec3> corners) { return 0.5 * glm::length(vectorArea(corners)); }

/// Twice the area of each triangle along the polygon's normal: all positive for a proper triangulation.
std::vector<double> signedAreas(std::span<const glm::vec3> corners) {
    std::vector<std::array<uint32_t, 3>> triangles;
    triangulate(corners, triangles);
    EXPECT_EQ(triangles.size(), corners.size() - 2);
    const glm::dvec3 normal = glm::normalize(vectorArea(corners));
    std::vector<double> areas;
    for (const auto& [a, b, c] : triangles) {
        const glm::vec3 t[] = {corners[a], corners[b], corners[c]};
        areas.push_back(0.5 * glm::dot(vectorArea(t), normal));
    }
    return areas;
}

void expectTriangulated(std::span<const glm::vec3> corners) {
    double sum = 0;
    for (double area : signedAreas(corners)) {
        EXPECT_GE(area, -1e-9);
        sum += area;
    }
    EXPECT_NEAR(sum, areaOf(corners), 1e-6 * areaOf(corners));
}

TEST(Polygon, ConvexAndConcaveQuads) {
    expectTriangulated(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    // An arrow head, with its inner corner at each place of the list.
    const std::vector<glm::vec3> arrow = {{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {1, 1, 0}};
    for (size_t shift = 0; shift < 4; ++shift) {
        std::vector<glm::vec3> turned;
        for (size_t i = 0; i < 4; ++i) turned.push_back(arrow[(i + shift) % 4]);
        expectTriangulated(turned);
    }
}

TEST(Polygon, RandomStarsInEveryPlane) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> radius(0.2, 1.0), angle(0, glm::two_pi<double>());
    for (int trial = 0; trial < 200; ++trial) {
        const int n = 5 + trial % 40;
        const double tilt = angle(random), spin = angle(random);
        std::vector<glm::vec3> corners;
        for (int i = 0; i < n; ++i) {
            const double a = glm::two_pi<double>() * i / n, r = radius(random);
            const double x = r * std::cos(a), y = r * std::sin(a);
            const glm::dvec3 p(x, y * std::cos(tilt), y * std::sin(tilt));
            corners.emplace_back(p.x * std::cos(spin) - p.y * std::sin(spin),
                                 p.x * std::sin(spin) + p.y * std::cos(spin), p.z);
        }
        expectTriangulated(corners);
    }
}

/// Rays of random length around a centre, and the teeth of a comb: every other corner is an inner one.
TEST(Polygon, ManyCornersTakeNoTime) {
    constexpr int kCorners = 40'000;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> radius(0.2, 1.0);
    std::vector<glm::vec3> star, comb = {{kCorners, -1000, 0}};
    for (int i = 0; i < kCorners; ++i) {
        const double a = glm::two_pi<double>() * i / kCorners, r = radius(random);
        star.emplace_back(r * std::cos(a), r * std::sin(a), 0);
        comb.emplace_back(kCorners - i, i % 2 ? 0 : 1000, 0);
    }
    comb.emplace_back(0, -1000, 0);
    const std::clock_t begun = std::clock();
    expectTriangulated(star);
    expectTriangulated(comb);
    EXPECT_LT(std::clock() - begun, 5 * CLOCKS_PER_SEC);
}

TEST(Polygon, CornersOnALineKeepTheirPlaces) {
    expectTriangulated(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 1, 0}, {0, 2, 0}});
}

TEST(Polygon, SelfIntersectingPolygonsEnd) {
    std::vector<std::array<uint32_t, 3>> triangles;
    triangulate(std::vector<glm::vec3>{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0.5f, 2, 0}}, triangles);
    EXPECT_EQ(triangles.size(), 3u);
    triangles.clear();
    triangulate(std::vector<glm::vec3>(6, glm::vec3(1)), triangles);
    EXPECT_EQ(triangles.size(), 4u);
}

/// A square of two faces, a triangle and a quad that share an edge: points 0 to 4.
struct Sample {
    std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}};
    std::vector<int> counts = {3, 4}, indices = {0, 1, 4, 1, 2, 3, 4};
    Mesh mesh;
    Problems problems;

    PolygonMesh polygons() const { return {.points = points, .counts = counts, .indices = indices}; }
    Topology build(const PolygonMesh& polygons) {
        Topology topology = buildTopology(polygons, problems);
        buildMesh(polygons, topology, mesh, problems);
        return topology;
    }
};

TEST(MeshBuilder, TrianglesFollowFaces) {
    Sample s;
    const Topology t = s.build(s.polygons());
    EXPECT_TRUE(s.problems.empty());
    ASSERT_EQ(t.triangles.size(), 3u);
    EXPECT_EQ(t.triangles[0], glm::uvec3(0, 1, 4));
    EXPECT_EQ(t.faces, (std::vector<uint32_t>{0, 1, 1}));
    EXPECT_TRUE(s.mesh.normals.empty()) << "flat without normals and without subdivision";
}

TEST(MeshBuilder, LeftHandedTurnsWinding) {
    Sample s;
    PolygonMesh p = s.polygons();
    p.leftHanded = true;
    const Topology t = s.build(p);
    EXPECT_EQ(t.triangles[0], glm::uvec3(0, 4, 1));
    p.smooth = true;
    s.build(p);
    for (glm::vec3 n : s.mesh.normals) EXPECT_EQ(n, glm::vec3(0, 0, -1));
}

TEST(MeshBuilder, SmoothNormalsOfACubeLookAlongItsDiagonals) {
    const std::vector<glm::vec3> points = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                           {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    const std::vector<int> counts(6, 4);
    const std::vector<int> indices = {4, 5, 6, 7, 1, 0, 3, 2, 5, 1, 2, 6, 0, 4, 7, 3, 7, 6, 2, 3, 0, 1, 5, 4};
    const PolygonMesh p{.points = points, .counts = counts, .indices = indices, .smooth = true};
    Problems problems;
    Mesh mesh;
    buildMesh(p, buildTopology(p, problems), mesh, problems);
    ASSERT_EQ(mesh.normals.size(), 36u);
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const glm::vec3 expected = points[mesh.triangles[t][k]] / std::sqrt(3.0f);
            EXPECT_LT(glm::length(mesh.normals[3 * t + k] - expected), 1e-6f);
        }
}

TEST(MeshBuilder, SmoothNormalsOfATinyMesh) {
    Sample s;
    for (glm::vec3& p : s.points) p *= 1e-18f;
    PolygonMesh p = s.polygons();
    p.smooth = true;
    s.build(p);
    EXPECT_EQ(s.mesh.triangles.size(), 3u);
    for (glm::vec3 n : s.mesh.normals) EXPECT_EQ(n, glm::vec3(0, 0, 1));
}

TEST(MeshBuilder, PrimvarsOfEveryInterpolation) {
    const auto uv = [](float x) { return glm::vec2(x, 0); };
    struct Case {
        Interpolation interpolation;
        std::vector<glm::vec2> values;
        std::vector<float> expected; // of the first triangle and the first of the quad
    };
    const Case cases[] = {
        {Interpolation::Constant, {uv(9)}, {9, 9, 9, 9, 9, 9}},
        {Interpolation::Uniform, {uv(1), uv(2)}, {1, 1, 1, 2, 2, 2}},
        {Interpolation::Vertex, {uv(0), uv(1), uv(2), uv(3), uv(4)}, {0, 1, 4, 1, 2, 3}},
        {Interpolation::Varying, {uv(0), uv(1), uv(2), uv(3), uv(4)}, {0, 1, 4, 1, 2, 3}},
        {Interpolation::FaceVarying, {uv(0), uv(1), uv(2), uv(3), uv(4), uv(5), uv(6)}, {0, 1, 2, 3, 4, 5}},
    };
    for (const Case& c : cases) {
        Sample s;
        PolygonMesh p = s.polygons();
        p.uvs = Primvar<glm::vec2>{c.values, c.interpolation, {}};
        s.build(p);
        ASSERT_EQ(s.mesh.uvs.size(), 9u);
        for (size_t i = 0; i < c.expected.size(); ++i) EXPECT_EQ(s.mesh.uvs[i].x, c.expected[i]);
        // The same through indices that turn the values around.
        const size_t n = c.values.size();
        std::vector<glm::vec2> reversed(c.values.rbegin(), c.values.rend());
        std::vector<int> indices;
        for (size_t i = 0; i < n; ++i) indices.push_back(static_cast<int>(n - 1 - i));
        Sample indexed;
        p = indexed.polygons();
        p.uvs = Primvar<glm::vec2>{reversed, c.interpolation, indices};
        indexed.build(p);
        EXPECT_EQ(indexed.mesh.uvs, s.mesh.uvs);
    }
}

TEST(MeshBuilder, AuthoredNormalsAreMadeUnitOrReplaced) {
    Sample s;
    PolygonMesh p = s.polygons();
    const std::vector<glm::vec3> normals = {{0, 3, 0}, {0, 0, 0}};
    p.normals = Primvar<glm::vec3>{normals, Interpolation::Uniform, {}};
    s.build(p);
    EXPECT_EQ(s.mesh.normals[0], glm::vec3(0, 1, 0));
    EXPECT_EQ(s.mesh.normals[3], glm::vec3(0, 0, 1));
    EXPECT_EQ(s.problems.size(), 1u);
}

TEST(MeshBuilder, PrimvarsOfWrongSizeAreLeftOut) {
    Sample s;
    PolygonMesh p = s.polygons();
    const std::vector<glm::vec2> two(2);
    const std::vector<int> wild = {0, 1, 0, 1, 7};
    p.uvs = Primvar<glm::vec2>{two, Interpolation::Vertex, {}};
    s.build(p);
    EXPECT_TRUE(s.mesh.uvs.empty());
    p.uvs = Primvar<glm::vec2>{two, Interpolation::Vertex, wild};
    s.build(p);
    EXPECT_TRUE(s.mesh.uvs.empty());
    EXPECT_EQ(s.problems.size(), 2u);
    EXPECT_EQ(s.mesh.triangles.size(), 3u);
}

TEST(MeshBuilder, BadFacesAreLeftOut) {
    struct Case {
        std::vector<int> counts, indices;
        glm::vec3 point0;
        size_t triangles, problems;
    };
    const Case cases[] = {
        {{3, 4}, {0, 1, 9, 1, 2, 3, 4}, {0, 0, 0}, 2, 1},    // out of range
        {{3, 4}, {0, 1, -1, 1, 2, 3, 4}, {0, 0, 0}, 2, 1},   // negative
        {{3, 4}, {0, 1, 4, 1, 2, 3, 4}, {kNan, 0, 0}, 2, 1}, // not finite
        {{3, 4}, {0, 1, 1, 1, 2, 3, 4}, {0, 0, 0}, 2, 1},    // no area
        {{2, 4}, {0, 1, 1, 2, 3, 4}, {0, 0, 0}, 2, 1},       // too few corners
        {{3, 5}, {0, 1, 4, 1, 2, 3, 4}, {0, 0, 0}, 1, 1},    // more corners than indices
        {{3}, {0, 1, 4, 1, 2, 3, 4}, {0, 0, 0}, 1, 1},       // fewer
        {{3, -4}, {0, 1, 4, 1, 2, 3, 4}, {0, 0, 0}, 1, 1},   // negative count
        {{3, 2000000000, 2000000000}, {0, 1, 4}, {0, 0, 0}, 1, 1},
        {{}, {}, {0, 0, 0}, 0, 0},
    };
    for (const Case& c : cases) {
        Sample s;
        s.counts = c.counts;
        s.indices = c.indices;
        s.points[0] = c.point0;
        s.build(s.polygons());
        EXPECT_EQ(s.mesh.triangles.size(), c.triangles);
        EXPECT_EQ(s.problems.size(), c.problems);
        for (glm::vec3 p : s.mesh.positions) EXPECT_FALSE(std::isnan(p.x));
    }
}

TEST(MeshBuilder, HolesAndSubsets) {
    Sample s;
    PolygonMesh p = s.polygons();
    const std::vector<int> holes = {0, 99}, second = {1}, wild = {0, 5};
    p.subsets = {second};
    s.build(p);
    EXPECT_EQ(s.mesh.triangleSubset, (std::vector<uint32_t>{0, 1, 1}));
    p.subsets = {wild};
    s.build(p);
    EXPECT_EQ(s.mesh.triangleSubset, (std::vector<uint32_t>{1, 0, 0}));
    EXPECT_EQ(s.problems.size(), 1u);
    p.holes = holes;
    s.build(p);
    EXPECT_EQ(s.mesh.triangles.size(), 2u);
}

TEST(MeshBuilder, PointsMoveWithinTheTopology) {
    Sample s;
    PolygonMesh p = s.polygons();
    p.deforming = p.smooth = true;
    const Topology topology = s.build(p);
    EXPECT_FALSE(updatePoints(p, topology, s.mesh, s.problems)) << "nothing moved";
    s.points[0] = {0, 0, 1};
    s.points[2] = {kNan, 0, 0};
    EXPECT_TRUE(updatePoints(p, topology, s.mesh, s.problems));
    EXPECT_EQ(s.mesh.positions[0], glm::vec3(0, 0, 1));
    EXPECT_EQ(s.mesh.positions[2], glm::vec3(2, 0, 0)) << "stays where it was";
    EXPECT_NE(s.mesh.normals[0], glm::vec3(0, 0, 1));
}

/// By the divergence theorem; also checks that normals are unit and on the side of the winding.
double volumeOf(const Mesh& mesh) {
    double volume = 0;
    EXPECT_EQ(mesh.normals.size(), 3 * mesh.triangles.size());
    EXPECT_EQ(mesh.uvs.size(), 3 * mesh.triangles.size());
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const glm::uvec3 v = mesh.triangles[t];
        const glm::dvec3 a = mesh.positions[v.x], b = mesh.positions[v.y], c = mesh.positions[v.z];
        const glm::dvec3 n = glm::cross(b - a, c - a);
        EXPECT_GT(glm::length(n), 0) << t;
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(glm::length(mesh.normals[3 * t + k]), 1, 1e-6);
            EXPECT_GT(glm::dot(glm::dvec3(mesh.normals[3 * t + k]), glm::normalize(n)), 0.9) << t;
        }
        volume += glm::dot(a, n) / 6;
    }
    return volume;
}

TEST(Shapes, VolumesAndNormals) {
    const double pi = glm::pi<double>();
    for (Axis axis : {Axis::X, Axis::Y, Axis::Z}) {
        Mesh mesh;
        buildCylinder(0.5, 0.5, 3, axis, mesh);
        EXPECT_NEAR(volumeOf(mesh), pi * 0.25 * 3, 2e-3 * pi * 0.25 * 3);
        buildCylinder(0.5, 0, 3, axis, mesh);
        EXPECT_NEAR(volumeOf(mesh), pi * 0.25, 2e-3 * pi * 0.25);
        EXPECT_EQ(mesh.positions.back()[(static_cast<int>(axis) + 1) % 3] * 0, 0);
        buildCapsule(0.5, 0.5, 1, axis, mesh);
        const double capsule = pi * 0.25 + pi / 6;
        EXPECT_NEAR(volumeOf(mesh), capsule, 3e-3 * capsule);
    }
    Mesh cube;
    buildCube(2, cube);
    EXPECT_NEAR(volumeOf(cube), 8, 1e-6);
}

TEST(Shapes, ConePointsAlongItsAxis) {
    for (Axis axis : {Axis::X, Axis::Y, Axis::Z}) {
        Mesh mesh;
        buildCylinder(1, 0, 4, axis, mesh);
        const int a = static_cast<int>(axis);
        size_t tips = 0;
        for (glm::vec3 p : mesh.positions)
            if (p[a] == 2) {
                ++tips;
                EXPECT_EQ(p[(a + 1) % 3], 0);
                EXPECT_EQ(p[(a + 2) % 3], 0);
            }
        EXPECT_GT(tips, 0u);
    }
}

TEST(Shapes, PlaneFacesItsAxis) {
    for (Axis axis : {Axis::X, Axis::Y, Axis::Z}) {
        Mesh mesh;
        buildPlane(4, 2, axis, mesh);
        glm::vec3 expected(0);
        expected[static_cast<int>(axis)] = 1;
        for (glm::vec3 n : mesh.normals) EXPECT_EQ(n, expected);
        glm::vec3 extent(0);
        for (glm::vec3 p : mesh.positions) extent = glm::max(extent, glm::abs(p));
        const glm::vec3 extents[] = {{0, 1, 2}, {2, 0, 1}, {2, 1, 0}};
        EXPECT_EQ(extent, extents[static_cast<int>(axis)]);
    }
}

} // namespace
} // namespace trilume::usd
