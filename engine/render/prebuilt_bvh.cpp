#include "render/prebuilt_bvh.h"

#include "scene/mesh_bvh.h"
#include <utility>

namespace trilume {

void buildMeshBvhs(Scene& scene) {
    TaskPool& pool = TaskPool::shared();
    for (uint32_t i = 0; i < scene.meshes().size(); ++i) {
        Mesh& mesh = scene.editMesh(MeshId{i});
        if (mesh.triangles.empty()) continue;
        rt::Bvh bvh = rt::buildBvh(rt::triangleBoxes(mesh.positions, mesh.triangles, pool).boxes, {}, pool);
        mesh.bvh = std::make_shared<const MeshBvh>(MeshBvh{.nodes = std::move(bvh.nodes),
                                                           .order = std::move(bvh.order),
                                                           .min = bvh.bounds.min,
                                                           .max = bvh.bounds.max,
                                                           .cost = bvh.cost,
                                                           .depth = bvh.depth,
                                                           .topologyRevision = mesh.topologyRevision,
                                                           .pointsRevision = mesh.pointsRevision});
    }
}

std::optional<rt::Bvh> builtBvh(const Mesh& mesh) {
    if (!mesh.bvh || mesh.bvh->topologyRevision != mesh.topologyRevision ||
        mesh.bvh->pointsRevision != mesh.pointsRevision)
        return {};
    return rt::Bvh{.nodes = mesh.bvh->nodes,
                   .order = mesh.bvh->order,
                   .bounds = {mesh.bvh->min, mesh.bvh->max},
                   .cost = mesh.bvh->cost,
                   .depth = mesh.bvh->depth};
}

} // namespace trilume
