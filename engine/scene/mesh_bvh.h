#pragma once

#include "shared/bvh.h"

#include <cstdint>
#include <vector>

namespace trilume {

/// The compute tracer's structure over a mesh's triangles, as rt::buildBvh makes it.
struct MeshBvh {
    std::vector<shared::BvhNode> nodes;
    std::vector<uint32_t> order; ///< leaf order to triangle
    glm::vec3 min{0}, max{0};
    float cost = 0;
    uint32_t depth = 0;
    uint64_t topologyRevision = 1, pointsRevision = 1; ///< of the mesh that it was made for
};

} // namespace trilume
