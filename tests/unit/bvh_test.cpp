#include "rt/bvh.h"

#include "core/error.h"
#include "triangle_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace trilume::rt {
namespace {

using shared::BvhNode;

using test::TriangleMesh;

TriangleMesh randomTriangles(uint32_t count, uint32_t seed, float size) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    auto vector = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    TriangleMesh result;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3 center = vector();
        result.add(center + size * vector(), center + size * vector(), center + size * vector());
    }
    return result;
}

bool isLeaf(uint32_t child) { return (child & shared::kBvhLeafBit) != 0; }
uint32_t firstOf(uint32_t child) { return child & shared::kBvhLeafFirstMask; }
uint32_t countOf(uint32_t child) { return (child >> shared::kBvhLeafCountShift) & shared::kBvhLeafCountMask; }

bool contains(const std::array<glm::dvec3, 2>& outer, const Box& inner) {
    return glm::all(glm::lessThanEqual(outer[0], glm::dvec3(inner.min))) &&
           glm::all(glm::greaterThanEqual(outer[1], glm::dvec3(inner.max)));
}

struct Walk {
    std::vector<uint32_t> seen; ///< how often each primitive was met
    uint32_t depth = 0;
};

/// Visits everything; expects that each child's box contains the primitives below it.
Box visit(const Bvh& bvh, std::span<const Box> boxes, uint32_t index, uint32_t depth, Walk& walk) {
    const BvhNode& node = bvh.nodes.at(index);
    walk.depth = std::max(walk.depth, depth);
    Box all;
    for (uint32_t c = 0; c < 4; ++c) {
        const uint32_t child = node.children[c];
        if (child == shared::kBvhEmpty) continue;
        Box below;
        if (isLeaf(child)) {
            for (uint32_t k = 0; k < countOf(child); ++k) {
                const uint32_t primitive = bvh.order.at(firstOf(child) + k);
                ++walk.seen.at(primitive);
                below.grow(boxes[primitive]);
            }
        } else {
            EXPECT_GT(child, index);
            below = visit(bvh, boxes, child, depth + 1, walk);
        }
        EXPECT_TRUE(below.empty() || contains(childBox(node, c), below)) << "node " << index << " child " << c;
        all.grow(below);
    }
    return all;
}

void check(const Bvh& bvh, std::span<const Box> boxes, uint32_t maxDepth = shared::kBvhMeshDepth) {
    Walk walk{std::vector<uint32_t>(boxes.size())};
    const Box all = visit(bvh, boxes, 0, 1, walk);
    for (size_t i = 0; i < boxes.size(); ++i) EXPECT_EQ(walk.seen[i], boxes[i].empty() ? 0u : 1u) << "primitive " << i;
    EXPECT_EQ(all.min, bvh.bounds.min);
    EXPECT_EQ(all.max, bvh.bounds.max);
    EXPECT_EQ(walk.depth, bvh.depth);
    EXPECT_LE(walk.depth, maxDepth);
}

Bvh build(const TriangleMesh& mesh, TaskPool& pool, std::vector<Box>* boxes = nullptr) {
    TriangleInput input = triangleBoxes(mesh.positions, mesh.triangles, pool);
    Bvh bvh = buildBvh(input.boxes, {}, pool);
    if (boxes) *boxes = std::move(input.boxes);
    return bvh;
}

TEST(Bvh, ContainsEveryPrimitiveOnce) {
    TaskPool pool(2);
    for (uint32_t count : {1u, 2u, 3u, 5u, 17u, 1000u, 150000u}) {
        SCOPED_TRACE(count);
        std::vector<Box> boxes;
        const Bvh bvh = build(randomTriangles(count, count, 0.05f), pool, &boxes);
        check(bvh, boxes);
    }
}

TEST(Bvh, OverNothingIsOneEmptyNode) {
    TaskPool pool(1);
    const Bvh bvh = buildBvh({}, {}, pool);
    ASSERT_EQ(bvh.nodes.size(), 1u);
    for (uint32_t child : bvh.nodes[0].children) EXPECT_EQ(child, shared::kBvhEmpty);
    EXPECT_TRUE(bvh.bounds.empty());
}

TEST(Bvh, DoesNotDependOnThreads) {
    const TriangleMesh mesh = randomTriangles(200000, 7, 0.02f);
    TaskPool one(1), four(4);
    const Bvh a = build(mesh, one), b = build(mesh, four);
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(0, std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(BvhNode)));
}

TEST(Bvh, DepthStaysBoundedWhereSahWouldPeelOffOneByOne) {
    // Each primitive is far smaller and nearer to the corner than the last: every cheap plane separates few from the
    // rest.
    std::vector<Box> boxes;
    for (int i = 0; i < 3000; ++i) {
        const float scale = std::ldexp(1.0f, -(i % 110)), jitter = 1.0f + 1e-3f * static_cast<float>(i / 110);
        boxes.push_back({glm::vec3(scale * jitter), glm::vec3(scale * jitter * 1.01f)});
    }
    TaskPool pool(2);
    for (uint32_t maxDepth : {shared::kBvhMeshDepth, shared::kBvhTopDepth, 6u}) {
        BvhOptions options;
        options.maxDepth = maxDepth;
        options.maxLeafSize = maxDepth == shared::kBvhTopDepth ? 1 : 4;
        check(buildBvh(boxes, options, pool), boxes, maxDepth);
    }
}

TEST(Bvh, RefusesMoreThanItsDepthHolds) {
    TaskPool pool(1);
    const std::vector<Box> boxes(65, Box{glm::vec3(0), glm::vec3(1)});
    BvhOptions options;
    options.maxDepth = 2;
    options.maxLeafSize = 4;
    EXPECT_THROW(buildBvh(boxes, options, pool), Error);
    check(buildBvh(std::span(boxes).first(64), options, pool), std::span(boxes).first(64), 2);
}

TEST(Bvh, TakesCoincidentAndExtremePrimitives) {
    TaskPool pool(2);
    std::vector<Box> boxes(5000, Box{glm::vec3(1), glm::vec3(2)});
    check(buildBvh(boxes, {}, pool), boxes);
    boxes.assign(5000, Box{glm::vec3(3), glm::vec3(3)});
    check(buildBvh(boxes, {}, pool), boxes);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> exponent(-30.0f, 17.9f), sign(-1.0f, 1.0f);
    auto value = [&] { return std::copysign(std::pow(10.0f, exponent(random)), sign(random)); };
    for (Box& box : boxes) {
        box = {};
        for (int i = 0; i < 2; ++i) box.grow(glm::vec3(value(), value(), value()));
    }
    check(buildBvh(boxes, {}, pool), boxes);
}

TEST(Bvh, LeavesOutWhatCannotBeHit) {
    TriangleMesh mesh = randomTriangles(100, 3, 0.1f);
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    mesh.add({nan, 0, 0}, {1, 0, 0}, {0, 1, 0});
    mesh.add({0, 0, 0}, {1, infinity, 0}, {0, 1, 0});
    mesh.add({0, 0, 0}, {1, 0, 0}, {0, 1, -1e30f});
    mesh.triangles.push_back({0, 1, 0xffffffffu});
    mesh.add({1, 1, 1}, {1, 1, 1}, {2, 3, 4});
    mesh.add({0, 0, 0}, {1, 2, 3}, {2, 4, 6});
    TaskPool pool(2);
    const TriangleInput input = triangleBoxes(mesh.positions, mesh.triangles, pool);
    EXPECT_EQ(input.invalid, 4u);
    EXPECT_EQ(input.degenerate, 2u);
    EXPECT_EQ(input.usable, 100u);
    const Bvh bvh = buildBvh(input.boxes, {}, pool);
    EXPECT_EQ(bvh.order.size(), 100u);
    check(bvh, input.boxes);
}

TEST(Bvh, RefitFollowsTheGeometryAndItsCost) {
    TaskPool pool(2);
    TriangleMesh mesh = randomTriangles(20000, 11, 0.02f);
    std::vector<Box> boxes;
    Bvh bvh = build(mesh, pool, &boxes);
    const float built = bvh.cost;
    refitBvh(bvh, boxes, {});
    EXPECT_NEAR(bvh.cost, built, 1e-4f * built);
    check(bvh, boxes);

    for (glm::vec3& p : mesh.positions) p = 3.0f * p + glm::vec3(100, 0, 0);
    refitBvh(bvh, triangleBoxes(mesh.positions, mesh.triangles, pool).boxes, {});
    EXPECT_NEAR(bvh.cost, built, 1e-3f * built) << "the cost does not depend on scale and place";

    // A few that move leave the rest as it is.
    boxes = triangleBoxes(mesh.positions, mesh.triangles, pool).boxes;
    std::vector<uint8_t> few(boxes.size());
    for (size_t i = 0; i < boxes.size(); i += 1777) {
        boxes[i].min += glm::vec3(0.5f, -0.2f, 0.1f);
        boxes[i].max += glm::vec3(0.5f, -0.2f, 0.1f);
        few[i] = 1;
    }
    Bvh whole = bvh;
    refitBvh(whole, boxes, {});
    refitBvh(bvh, boxes, {}, few);
    EXPECT_EQ(std::memcmp(bvh.nodes.data(), whole.nodes.data(), bvh.nodes.size() * sizeof(shared::BvhNode)), 0);
    EXPECT_EQ(bvh.cost, whole.cost);
    EXPECT_EQ(bvh.bounds, whole.bounds);

    // Triangles that go anywhere leave the old topology worthless.
    const TriangleMesh other = randomTriangles(20000, 12, 0.02f);
    const std::vector<Box> moved = triangleBoxes(other.positions, mesh.triangles, pool).boxes;
    refitBvh(bvh, moved, {});
    check(bvh, moved);
    EXPECT_GT(bvh.cost, 3.0f * built);
}

TEST(Bvh, SahBeatsMedianSplits) {
    TaskPool pool(2);
    // Dense clusters of tiny triangles in a large sparse room.
    TriangleMesh mesh = randomTriangles(20000, 21, 0.001f);
    for (size_t i = 0; i < mesh.positions.size(); ++i) mesh.positions[i] *= i / 3 % 4 == 0 ? 1.0f : 0.01f;
    const TriangleInput input = triangleBoxes(mesh.positions, mesh.triangles, pool);
    BvhOptions median;
    median.maxDepth = 7; // 4 * 4^7 leaves no room for anything but medians at the upper levels
    const Bvh sah = buildBvh(input.boxes, {}, pool), plain = buildBvh(input.boxes, median, pool);
    EXPECT_LT(sah.cost, 0.8f * plain.cost);
}

} // namespace
} // namespace trilume::rt
