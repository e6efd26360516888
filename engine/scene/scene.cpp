#include "scene/scene.h"

#include <array>
#include <cmath>
#include <utility>

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

} // namespace

MeshId Scene::addMesh(Mesh mesh) {
    meshes_.push_back(std::move(mesh));
    return static_cast<MeshId>(meshes_.size() - 1);
}

MaterialId Scene::addMaterial(Material material) {
    materials_.push_back(std::move(material));
    return static_cast<MaterialId>(materials_.size() - 1);
}

TextureId Scene::addTexture(Texture texture) {
    textures_.push_back(std::move(texture));
    return static_cast<TextureId>(textures_.size() - 1);
}

Texture& Scene::editTexture(TextureId id) {
    Texture& texture = textures_[static_cast<uint32_t>(id)];
    ++texture.revision;
    return texture;
}

Material& Scene::editMaterial(MaterialId id) {
    Material& material = materials_[static_cast<uint32_t>(id)];
    ++material.revision;
    return material;
}

Entity Scene::createEntity(std::string path, glm::dmat4 parentFromLocal, Entity parent) {
    const Entity entity = world.create();
    world.add(entity, Name{std::move(path)});
    world.add(entity, LocalTransform{parentFromLocal});
    if (parent) world.add(entity, Parent{parent});
    return entity;
}

bool Scene::isVisible(Entity entity) const {
    const InheritedVisibility* visibility = world.find<InheritedVisibility>(entity);
    return !visibility || visibility->visible;
}

const Bounds& Scene::localBounds(MeshId id) const {
    localBounds_.resize(meshes_.size());
    LocalBounds& cached = localBounds_[static_cast<uint32_t>(id)];
    const Mesh& m = mesh(id);
    if (cached.pointsRevision == m.pointsRevision) return cached.bounds;
    cached = {m.pointsRevision, {}};
    for (const glm::vec3& p : m.positions)
        if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) cached.bounds.grow(glm::dvec3(p));
    return cached.bounds;
}

Bounds Scene::bounds() const {
    Bounds all;
    const auto growBy = [&](Entity entity, auto&& boundsIn) {
        const WorldTransform* transform = world.find<WorldTransform>(entity);
        if (!transform || !isVisible(entity)) return;
        const Bounds b = boundsIn(transform->worldFromLocal);
        if (!b.empty() && finite(b)) all.grow(b);
    };
    world.each<MeshInstance>([&](Entity entity, const MeshInstance& instance) {
        if (static_cast<size_t>(instance.mesh) >= meshes_.size()) return;
        growBy(entity, [&](const glm::dmat4& m) { return transformed(localBounds(instance.mesh), m); });
    });
    world.each<SphereInstance>([&](Entity entity, const SphereInstance& sphere) {
        growBy(entity, [&](const glm::dmat4& m) { return transformedSphere(sphere.radius, m); });
    });
    world.each<Light>([&](Entity entity, const Light& light) {
        growBy(entity, [&](const glm::dmat4& m) { return lightBounds(light, m); });
    });
    return all;
}

void Scene::setTime(double timeCode) {
    if (source) source->setTime(timeCode);
}

} // namespace trilume
