#include "scene/scene.h"

#include <algorithm>

namespace trilume {
namespace {

bool emits(const Scene& scene, MaterialId id) {
    if (static_cast<size_t>(id) >= scene.materials().size()) return false;
    const glm::vec3 emission = scene.material(id).emission;
    return std::max({emission.x, emission.y, emission.z}) > 0 ||
           scene.material(id).emissionMap.texture != TextureId::None;
}

} // namespace

bool hasLight(const Scene& scene) {
    bool found = scene.world.count<Light>() > 0;
    scene.world.each<MeshInstance>([&](Entity entity, const MeshInstance& mesh) {
        const auto emissive = [&](MaterialId id) { return emits(scene, id); };
        found |= scene.isVisible(entity) && std::any_of(mesh.materials.begin(), mesh.materials.end(), emissive);
    });
    scene.world.each<SphereInstance>([&](Entity entity, const SphereInstance& sphere) {
        found |= scene.isVisible(entity) && emits(scene, sphere.material);
    });
    return found;
}

Entity addDefaultLight(Scene& scene) {
    const Entity entity = scene.createEntity("/trilumeDefaultLight");
    scene.world.add(entity, Light{.kind = LightKind::Dome, .radiance = glm::vec3(1)});
    return entity;
}

} // namespace trilume
