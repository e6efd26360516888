#include "scene/scene.h"

#include <utility>

namespace trilume {

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

void Scene::setTime(double timeCode) {
    if (source) source->setTime(timeCode);
}

} // namespace trilume
