#pragma once

#include "rt/bvh.h"
#include "scene/scene.h"

#include <optional>

namespace trilume {

/// Gives every mesh of the scene its BVH, as a snapshot keeps it.
void buildMeshBvhs(Scene& scene);

/// The one that the mesh came with, unless it has changed since.
std::optional<rt::Bvh> builtBvh(const Mesh& mesh);

} // namespace trilume
