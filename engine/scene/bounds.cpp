#include "scene/bounds.h"

#include "scene/scene.h"

#include <cmath>

namespace trilume {
namespace {

/// Of the box transformed by an affine matrix: its centre moves, its half extent grows by the absolute matrix.
Bounds transformed(const Bounds& box, const glm::dmat4& m) {
    if (box.empty()) return {};
    const glm::dvec3 center = glm::dvec3(m * glm::dvec4(box.center(), 1));
    const glm::dvec3 half = 0.5 * (box.max - box.min);
    const glm::dvec3 extent =
        glm::abs(glm::dvec3(m[0])) * half.x + glm::abs(glm::dvec3(m[1])) * half.y + glm::abs(glm::dvec3(m[2])) * half.z;
    return {center - extent, center + extent};
}

/// Exact: along each world axis an ellipsoid reaches as far as the matrix's row is long.
Bounds transformedSphere(double radius, const glm::dmat4& m) {
    const glm::dmat3 rows = glm::transpose(glm::dmat3(m));
    const glm::dvec3 extent = radius * glm::dvec3(glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2]));
    return {glm::dvec3(m[3]) - extent, glm::dvec3(m[3]) + extent};
}

Bounds boxOfHalfExtent(double x, double y, double z) { return {{-x, -y, -z}, {x, y, z}}; }

/// Empty for lights at infinity.
Bounds lightBounds(const Light& light, const glm::dmat4& worldFromLocal) {
    switch (light.kind) {
    case LightKind::Rect:
        return transformed(boxOfHalfExtent(0.5 * light.width, 0.5 * light.height, 0), worldFromLocal);
    case LightKind::Disk:
        return transformed(boxOfHalfExtent(light.radius, light.radius, 0), worldFromLocal);
    case LightKind::Sphere:
        return transformedSphere(light.radius, worldFromLocal);
    case LightKind::Cylinder:
        return transformed(boxOfHalfExtent(0.5 * light.length, light.radius, light.radius), worldFromLocal);
    case LightKind::Distant:
    case LightKind::Dome:
        break;
    }
    return {};
}

bool finite(const Bounds& b) { return std::isfinite(glm::length(b.min)) && std::isfinite(glm::length(b.max)); }

/// Whether the box makes `all` as large as it is.
bool reachesEnd(const Bounds& box, const Bounds& all) {
    return !box.empty() && (glm::any(glm::equal(box.min, all.min)) || glm::any(glm::equal(box.max, all.max)));
}

} // namespace

const Bounds& SceneBounds::update(const Scene& scene) {
    const World& world = scene.world;
    const std::array turnovers = {world.turnover<MeshInstance>(), world.turnover<SphereInstance>(),
                                  world.turnover<Light>(), world.turnover<WorldTransform>(),
                                  world.turnover<InheritedVisibility>()};
    const bool meshesChanged = updateMeshes(scene);
    if (!seen_ || meshesChanged || turnovers != turnovers_) {
        measureAll(scene);
    } else if (world.now() != *seen_) {
        measureChanged(scene, *seen_);
    }
    turnovers_ = turnovers;
    seen_ = world.now();
    return all_;
}

bool SceneBounds::updateMeshes(const Scene& scene) {
    bool changed = meshes_.size() != scene.meshes().size();
    meshes_.resize(scene.meshes().size());
    for (size_t i = 0; i < meshes_.size(); ++i) {
        const Mesh& mesh = scene.meshes()[i];
        MeshBounds& bounds = meshes_[i];
        if (bounds.pointsRevision == mesh.pointsRevision) continue;
        bounds = {mesh.pointsRevision, {}};
        for (const glm::vec3& p : mesh.positions)
            if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) bounds.local.grow(glm::dvec3(p));
        changed = true;
    }
    return changed;
}

void SceneBounds::measureAll(const Scene& scene) {
    boxes_.clear();
    all_ = {};
    const auto measure = [&](Entity entity, const auto&) {
        if (boxes_.size() <= entity.index) boxes_.resize(entity.index + 1);
        all_.grow(boxes_[entity.index] = measured(scene, entity));
    };
    scene.world.each<MeshInstance>(measure);
    scene.world.each<SphereInstance>(measure);
    scene.world.each<Light>(measure);
}

void SceneBounds::measureChanged(const Scene& scene, Tick since) {
    bool shrinks = false;
    const auto measure = [&](Entity entity, const auto&) {
        if (boxes_.size() <= entity.index) return; // without extent
        Bounds& box = boxes_[entity.index];
        shrinks |= reachesEnd(box, all_);
        all_.grow(box = measured(scene, entity));
    };
    scene.world.eachChanged<WorldTransform>(since, measure);
    scene.world.eachChanged<InheritedVisibility>(since, measure);
    scene.world.eachChanged<MeshInstance>(since, measure);
    scene.world.eachChanged<SphereInstance>(since, measure);
    scene.world.eachChanged<Light>(since, measure);
    if (!shrinks) return;
    all_ = {};
    for (const Bounds& box : boxes_) all_.grow(box);
}

Bounds SceneBounds::measured(const Scene& scene, Entity entity) const {
    const World& world = scene.world;
    const WorldTransform* transform = world.find<WorldTransform>(entity);
    if (!transform || !scene.isVisible(entity)) return {};
    Bounds all;
    const auto add = [&](const Bounds& box) {
        if (!box.empty() && finite(box)) all.grow(box);
    };
    const glm::dmat4& m = transform->worldFromLocal;
    const MeshInstance* mesh = world.find<MeshInstance>(entity);
    if (mesh && static_cast<size_t>(mesh->mesh) < meshes_.size())
        add(transformed(meshes_[static_cast<size_t>(mesh->mesh)].local, m));
    if (const SphereInstance* sphere = world.find<SphereInstance>(entity)) add(transformedSphere(sphere->radius, m));
    if (const Light* light = world.find<Light>(entity)) add(lightBounds(*light, m));
    return all;
}

} // namespace trilume
