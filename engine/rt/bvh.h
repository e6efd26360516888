#pragma once

#include "core/task_pool.h"
#include "shared/bvh.h"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace trilume::rt {

/// An axis-aligned box; empty until something is added.
struct Box {
    glm::vec3 min{std::numeric_limits<float>::infinity()};
    glm::vec3 max{-std::numeric_limits<float>::infinity()};

    void grow(glm::vec3 point) {
        min = glm::min(min, point);
        max = glm::max(max, point);
    }
    void grow(const Box& other) {
        min = glm::min(min, other.min);
        max = glm::max(max, other.max);
    }
    bool empty() const { return !(min.x <= max.x); }
    friend bool operator==(const Box&, const Box&) = default;
    /// Half the surface area; 0 when empty.
    float halfArea() const {
        if (empty()) return 0.0f;
        const glm::vec3 d = max - min;
        return d.x * d.y + d.y * d.z + d.z * d.x;
    }
};

struct BvhOptions {
    uint32_t maxDepth = shared::kBvhMeshDepth; ///< inner levels; splits turn to medians where SAH would exceed it
    uint32_t maxLeafSize = 4;                  ///< 1 to 15
    float traversalCost = 1.0f;                ///< of one node, relative to one primitive
};

/// A BVH with quantised boxes (shaders/shared/bvh.h). Node 0 is the root; children stand after their parents.
struct Bvh {
    std::vector<shared::BvhNode> nodes; ///< never empty: over nothing, it is one node with empty children
    std::vector<uint32_t> order;        ///< leaf order to index of the primitive that the builder was given
    Box bounds;
    float cost = 0.0f;  ///< expected cost of a random ray that hits the bounds (surface area heuristic)
    uint32_t depth = 0; ///< inner levels
    struct Refit {
        Box box;
        double cost = 0.0;
    };
    std::vector<Refit> refits; ///< of each node, once refit
};

/// Builds top-down by binned SAH (Wald 2007), straight to four children a node by splitting the child of largest area.
/// Boxes lie within +-1e18 or are empty; empty ones are left out. Deterministic, whatever the number of threads.
/// Throws inputError when there are more than 2^27 - 1, or more than 4^maxDepth leaves hold, or more than 2^24 nodes
/// come of them.
Bvh buildBvh(std::span<const Box> boxes, const BvhOptions& options, TaskPool& pool);

/// Keeps the topology and recomputes boxes and the cost. `boxes` as given to the builder, with new extents; `moved`
/// tells which differ from those of the last refit, empty: any may. Nodes above none that moved stay as they are.
void refitBvh(Bvh& bvh, std::span<const Box> boxes, const BvhOptions& options, std::span<const uint8_t> moved = {});

/// The triangles of a mesh that can be hit, with what was left out.
struct TriangleInput {
    std::vector<Box> boxes; ///< one per triangle of the mesh; empty where it is left out
    uint32_t usable = 0;
    uint32_t invalid = 0;    ///< a corner is not finite, beyond +-1e18, or its index is out of range
    uint32_t degenerate = 0; ///< no area
};

/// Boxes of the triangles; those that are invalid or have no area get an empty box.
TriangleInput triangleBoxes(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                            TaskPool& pool);

/// Decodes one child's box; exact in double precision.
std::array<glm::dvec3, 2> childBox(const shared::BvhNode& node, uint32_t child);

} // namespace trilume::rt
