#include "render/gpu_scene.h"

#include "core/log.h"
#include "light/distribution2d.h"
#include "render/prebuilt_bvh.h"

#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <utility>

namespace trilume {

namespace {

using shared::kNone;

/// In place of an instance's index: when the entity moves, lights do as well.
constexpr uint32_t kLit = kNone - 1;

glm::mat4x3 affine(const glm::dmat4& m) { return glm::mat4x3(glm::mat4(m)); }

template<class T>
gpu::Buffer uploaded(gpu::Device& device, const std::vector<T>& values, const std::string& name, const char* what) {
    if (values.empty()) return {};
    return device.createBufferFrom(std::span<const T>(values), name + ": " + what);
}

/// The unit shape (shaders/shared/scene.h) that a light's geometry is, and where it lies in the light's local space.
std::pair<uint32_t, glm::dmat4> lightShape(const Light& light) {
    switch (light.kind) {
    case LightKind::Rect:
        return {shared::kShapeRect, glm::scale(glm::dmat4(1), {light.width, light.height, 1})};
    case LightKind::Disk:
        return {shared::kShapeDisk, glm::scale(glm::dmat4(1), {light.radius, light.radius, 1})};
    case LightKind::Sphere:
        return {shared::kShapeSphere, glm::scale(glm::dmat4(1), glm::dvec3(light.radius))};
    case LightKind::Cylinder:
        return {shared::kShapeCylinder, glm::scale(glm::dmat4(1), {light.length, light.radius, light.radius})};
    case LightKind::Distant:
    case LightKind::Dome:
        break;
    }
    return {kNone, glm::dmat4(1)};
}

glm::dmat4 ballOf(const SphereInstance& sphere) { return glm::scale(glm::dmat4(1), glm::dvec3(sphere.radius)); }

bool isInfinite(const Light& light) { return light.kind == LightKind::Distant || light.kind == LightKind::Dome; }

uint32_t maskOf(const Visibility* visibility) {
    uint32_t mask = shared::kMaskIndirect;
    if (!visibility || visibility->camera) mask |= shared::kMaskCamera;
    if (!visibility || visibility->shadow) mask |= shared::kMaskShadow;
    return mask;
}

} // namespace

GpuScene::GpuScene(gpu::Device& device, gpu::Tracer tracer, Scene& scene)
    : device_(device), scene_(scene), materials_(device), accel_(device, tracer) {}

void GpuScene::update() {
    previousTable_ = table_;
    retired_.clear();
    lightsRenumbered_ = false;
    const bool hasPrevious = std::exchange(complete_, false);
    followChanges();
    complete_ = true;
    if (!hasPrevious) previousTable_ = table_;
}

void GpuScene::followChanges() {
    scene_.updateTransforms();
    const bool first = !seen_;
    if (first) {
        const Bounds bounds = scene_.bounds();
        if (!bounds.empty()) origin_ = bounds.center();
    }
    accel_.beginUpdate();
    facts_.dynamicInstances = facts_.changedLights = 0;
    facts_.geometryChanged = false;
    const bool materialsChanged = materials_.update(scene_);
    const bool meshesChanged = updateMeshes();
    const bool still = !facts_.sceneChanged;
    facts_.sceneChanged = first || materialsChanged || meshesChanged || scene_.world.now() != *seen_;
    if (!facts_.sceneChanged && still) return;
    ++revision_;
    if (!facts_.sceneChanged) return;
    if (materialsChanged || meshesChanged) ++facts_.lightingRevision;
    if (materialsChanged || meshesChanged || first || !moveInstances()) updateInstances();
    const rt::AccelStats& built = accel_.stats();
    facts_.geometryChanged = built.blasBuilt + built.blasRefit + built.tlasBuilt > 0;
    seen_ = scene_.world.now(); // an update that failed is tried again
}

bool GpuScene::updateMeshes() {
    bool changed = false;
    meshes_.resize(scene_.meshes().size());
    for (size_t i = 0; i < meshes_.size(); ++i) {
        const Mesh& mesh = scene_.meshes()[i];
        DeviceMesh& device = meshes_[i];
        if (device.topologyRevision == mesh.topologyRevision && device.pointsRevision == mesh.pointsRevision) continue;
        updateMesh(mesh, device);
        changed = true;
    }
    if (!changed && meshTable_.size() != 0) return false;

    std::vector<shared::Mesh> table;
    for (size_t i = 0; i < meshes_.size(); ++i) {
        const DeviceMesh& device = meshes_[i];
        shared::Mesh m{};
        if (device.present) {
            const rt::MeshAccelAddresses accel = accel_.addresses(device.accel);
            m.nodes = accel.nodes;
            m.leafTriangles = accel.leafTriangles;
            m.triangles = device.triangles.address();
            m.positions = device.positions.address();
            m.normals = device.normals.address();
            m.uvs = device.uvs.address();
            m.subsets = device.subsets.address();
            m.triangleCount = static_cast<uint32_t>(scene_.meshes()[i].triangles.size());
            if (device.normals) m.flags |= shared::kMeshHasNormals;
            if (device.uvs) m.flags |= shared::kMeshHasUvs;
            if (device.subsets) m.flags |= shared::kMeshHasSubsets;
        }
        table.push_back(m);
    }
    return meshTable_.assign(device_, std::move(table)) || changed;
}

void GpuScene::updateMesh(const Mesh& mesh, DeviceMesh& device) {
    if (device.topologyRevision != mesh.topologyRevision) {
        if (std::exchange(device.present, false)) accel_.removeMesh(device.accel);
        if (!mesh.triangles.empty()) {
            const std::optional<rt::Bvh> built = builtBvh(mesh);
            device.accel =
                accel_.addMesh(mesh.positions, mesh.triangles, mesh.deforming, mesh.name, built ? &*built : nullptr);
            device.present = true;
            if (const uint32_t invalid = accel_.report(device.accel).invalid)
                log::warning("{}: {} triangles have no place: left out", mesh.name, invalid);
        }
        replace(device.triangles, uploaded(device_, mesh.triangles, mesh.name, "triangles"));
        replace(device.uvs, uploaded(device_, mesh.uvs, mesh.name, "texture coordinates"));
        replace(device.subsets, uploaded(device_, mesh.triangleSubset, mesh.name, "subsets"));
    } else if (device.present) {
        accel_.updateMesh(device.accel, mesh.positions);
    }
    if (device.present) {
        replace(device.positions, uploaded(device_, mesh.positions, mesh.name, "positions"));
        replace(device.normals, uploaded(device_, mesh.normals, mesh.name, "normals"));
        device.balls = ballsOfSubsets(mesh);
    }
    // Last: an update that failed is tried again.
    device.topologyRevision = mesh.topologyRevision;
    device.pointsRevision = mesh.pointsRevision;
}

void GpuScene::replace(gpu::Buffer& buffer, gpu::Buffer replacement) {
    if (buffer) retired_.push_back(std::move(buffer));
    buffer = std::move(replacement);
}

void GpuScene::place(shared::Instance& instance, rt::InstanceInput& traced, const WorldTransform& transform,
                     const glm::dmat4& localFromShape) const {
    const auto renderFromShape = [&](const glm::dmat4& worldFromLocal) {
        glm::dmat4 m = worldFromLocal * localFromShape;
        m[3] -= glm::dvec4(origin_, 0);
        return m;
    };
    const glm::dmat4 now = renderFromShape(transform.worldFromLocal);
    instance.worldFromLocal = affine(now);
    instance.localFromWorld = affine(glm::inverse(now));
    instance.previousWorldFromLocal = affine(renderFromShape(transform.previousWorldFromLocal));
    instance.flags = glm::determinant(glm::dmat3(now)) < 0 ? shared::kInstanceFlips : 0;
    traced.worldFromLocal = instance.worldFromLocal;
}

uint32_t GpuScene::addInstance(Draft& draft, Entity entity, uint32_t shape, uint32_t mesh,
                               const glm::dmat4& localFromShape, std::span<const uint32_t> materials, uint32_t mask) {
    const auto index = static_cast<uint32_t>(draft.instances.size());
    shared::Instance& instance = draft.instances.emplace_back(shared::Instance{});
    instance.shape = shape;
    instance.mesh = mesh;
    instance.firstMaterial = static_cast<uint32_t>(draft.materialIndices.size());
    instance.firstLight = kNone;
    instance.mask = mask;
    draft.materialIndices.insert(draft.materialIndices.end(), materials.begin(), materials.end());

    rt::InstanceInput& traced = draft.traced.emplace_back();
    traced.shape = shape;
    traced.mesh = mesh == kNone ? rt::MeshAccelId{} : meshes_[mesh].accel;
    traced.mask = mask;
    place(instance, traced, *scene_.world.find<WorldTransform>(entity), localFromShape);

    if (instanceOf_.size() <= entity.index) instanceOf_.resize(entity.index + 1, kNone);
    uint32_t& instanceOf = instanceOf_[entity.index];
    instanceOf = instanceOf == kNone ? index : kLit; // one with several shapes is rare enough to be treated as lit
    return index;
}

uint32_t GpuScene::stableId(Entity entity, uint32_t count) {
    const uint64_t key = uint64_t{entity.generation} << 32 | entity.index;
    auto [it, fresh] = lightIds_.try_emplace(key, 0, 0);
    if (fresh || it->second.second < count) {
        it->second = {nextLightId_, count};
        nextLightId_ += count;
    }
    return it->second.first;
}

void GpuScene::matchLights(std::span<const shared::Light> previous, std::span<const shared::Light> current) {
    // A light that becomes another kind has another sample space: to the frames around the change, another light.
    const auto identity = [](const shared::Light& light) {
        const bool oneDirection = light.kind == shared::kLightDistant && !(light.radius > 0);
        return uint64_t{light.id} << 8 | uint64_t{light.kind} << 1 | uint64_t{oneDirection};
    };
    lightsRenumbered_ = !std::ranges::equal(previous, current, {}, identity, identity);
    if (!lightsRenumbered_) return;
    std::unordered_map<uint64_t, uint32_t> places;
    for (uint32_t i = 0; i < previous.size(); ++i) places.emplace(identity(previous[i]), i);
    std::vector<uint32_t> currentOf(previous.size(), kNone), previousOf(current.size(), kNone);
    for (uint32_t i = 0; i < current.size(); ++i) {
        const auto place = places.find(identity(current[i]));
        if (place == places.end()) continue;
        previousOf[i] = place->second;
        currentOf[place->second] = i;
    }
    currentLight_.assign(device_, std::move(currentOf));
    previousLight_.assign(device_, std::move(previousOf));
}

const GpuScene::LightTexture* GpuScene::lightTexture(TextureId texture, LightKind kind, uint32_t& distribution) {
    distribution = kNone;
    if (materials_.image(texture) == kNone) return nullptr;
    LightTexture& entry = lightTextures_[{texture, kind}];
    const Texture& source = scene_.texture(texture);
    if (entry.revision != source.revision) {
        const TextureDistribution d =
            buildTextureDistribution(source, kind == LightKind::Dome ? TextureDomain::LatLong : TextureDomain::Rect);
        entry.marginal = uploaded(device_, d.marginal, source.name, "marginal");
        entry.conditional = uploaded(device_, d.conditional, source.name, "conditional");
        entry.density = uploaded(device_, d.density, source.name, "density");
        entry.record = {entry.marginal.address(), entry.conditional.address(), entry.density.address(), d.width,
                        d.height};
        entry.mean = d.mean;
        entry.revision = source.revision;
    }
    distribution = static_cast<uint32_t>(usedDistributions_.size());
    usedDistributions_.push_back(entry.record);
    return &entry;
}

void GpuScene::markLit(Entity entity) {
    if (instanceOf_.size() <= entity.index) instanceOf_.resize(entity.index + 1, kNone);
    instanceOf_[entity.index] = kLit;
}

void GpuScene::addLight(Draft& draft, const Light& light, const glm::dmat4& worldFromLocal, uint32_t instance,
                        Entity owner) {
    markLit(owner);
    LightInput input{
        .component = &light, .worldFromLocal = worldFromLocal, .instance = instance, .id = stableId(owner, 1)};
    if (const LightTexture* texture = lightTexture(light.texture, light.kind, input.distribution)) {
        input.image = materials_.image(light.texture);
        input.textureMean = texture->mean;
    }
    draft.lights.push_back(input);
}

void GpuScene::addMeshes(Draft& draft) {
    scene_.world.each<MeshInstance>([&](Entity entity, const MeshInstance& component) {
        const auto meshIndex = static_cast<uint32_t>(component.mesh);
        if (component.mesh == MeshId::None || !meshes_[meshIndex].present || !scene_.isVisible(entity)) return;
        const Mesh& mesh = scene_.mesh(component.mesh);
        uint32_t subsets = static_cast<uint32_t>(component.materials.size());
        for (const uint32_t subset : mesh.triangleSubset) subsets = std::max(subsets, subset + 1);
        std::vector<uint32_t> materials(std::max(subsets, 1u), materials_.index(MaterialId::None));
        bool emits = false;
        for (size_t i = 0; i < component.materials.size(); ++i) {
            materials[i] = materials_.index(component.materials[i]);
            emits |= (materials_.material(materials[i]).flags & shared::kMaterialEmissive) != 0;
        }
        const WorldTransform& transform = *scene_.world.find<WorldTransform>(entity);
        const uint32_t instance = addInstance(draft, entity, shared::kShapeMesh, meshIndex, glm::dmat4(1), materials,
                                              maskOf(scene_.world.find<Visibility>(entity)));
        if (!emits) return;
        markLit(entity);
        EmissiveMeshInput input{};
        input.mesh = &mesh;
        input.worldFromLocal = transform.worldFromLocal;
        input.instance = instance;
        const auto materialOf = [&mesh, materials](uint32_t triangle) {
            return materials[mesh.triangleSubset.empty() ? 0 : mesh.triangleSubset[triangle]];
        };
        input.radiance = [this, materialOf](uint32_t triangle) { return materials_.emission(materialOf(triangle)); };
        input.varies = [this, materialOf](uint32_t triangle) {
            return materials_.emissionVaries(materialOf(triangle));
        };
        input.firstId = stableId(entity, static_cast<uint32_t>(mesh.triangles.size()));
        draft.emissive.push_back(std::move(input));
    });
}

void GpuScene::addSpheres(Draft& draft) {
    scene_.world.each<SphereInstance>([&](Entity entity, const SphereInstance& sphere) {
        if (!(sphere.radius > 0) || !scene_.isVisible(entity)) return;
        const WorldTransform& transform = *scene_.world.find<WorldTransform>(entity);
        const uint32_t material = materials_.index(sphere.material);
        const uint32_t instance = addInstance(draft, entity, shared::kShapeSphere, kNone, ballOf(sphere),
                                              std::span(&material, 1), maskOf(scene_.world.find<Visibility>(entity)));
        if (materials_.emission(material) == glm::vec3(0)) return;
        Light& light = draft.emitters.emplace_back();
        light.kind = LightKind::Sphere;
        light.radius = sphere.radius;
        light.radiance = materials_.emission(material);
        addLight(draft, light, transform.worldFromLocal, instance, entity);
        if (materials_.emissionVaries(material)) draft.lights.back().image = 0;
    });
}

void GpuScene::addLights(Draft& draft) {
    scene_.world.each<Light>([&](Entity entity, const Light& light) {
        if (!scene_.isVisible(entity)) return;
        const WorldTransform& transform = *scene_.world.find<WorldTransform>(entity);
        if (isInfinite(light)) {
            addLight(draft, light, transform.worldFromLocal, kNone, entity);
            return;
        }
        const auto [shape, localFromShape] = lightShape(light);
        markLit(entity); // even without extent, which it may gain
        // Without extent it neither shines nor blocks; a light of radiance 0 still blocks, as a lamp switched off.
        if (glm::determinant(glm::dmat3(transform.worldFromLocal * localFromShape)) == 0) return;
        uint32_t mask = maskOf(scene_.world.find<Visibility>(entity));
        if (!light.visibleToCamera) mask &= ~shared::kMaskCamera;
        const uint32_t material = GpuMaterials::kBlack;
        const uint32_t instance =
            addInstance(draft, entity, shape, kNone, localFromShape, std::span(&material, 1), mask);
        addLight(draft, light, transform.worldFromLocal, instance, entity);
    });
}

std::array<uint64_t, 6> GpuScene::turnovers() const {
    const World& world = scene_.world;
    return {world.turnover<MeshInstance>(),   world.turnover<SphereInstance>(), world.turnover<Light>(),
            world.turnover<WorldTransform>(), world.turnover<Visibility>(),     world.turnover<InheritedVisibility>()};
}

bool GpuScene::onlyTransformsChanged() const {
    bool others = turnovers() != turnovers_;
    const auto note = [&](Entity, const auto&) { others = true; };
    scene_.world.eachChanged<MeshInstance>(*seen_, note);
    scene_.world.eachChanged<SphereInstance>(*seen_, note);
    scene_.world.eachChanged<Light>(*seen_, note);
    scene_.world.eachChanged<Visibility>(*seen_, note);
    scene_.world.eachChanged<InheritedVisibility>(*seen_, note);
    return !others;
}

bool GpuScene::moveInstances() {
    if (!onlyTransformsChanged()) return false;
    // The power of lights at infinity, and so the choice among all, goes by the scene's size.
    const Bounds bounds = scene_.bounds();
    if (table_.infiniteLightCount > 0 && static_cast<float>(bounds.radius()) != table_.boundsRadius) return false;
    std::vector<std::pair<uint32_t, Entity>> moved;
    bool lit = false;
    scene_.world.eachChanged<WorldTransform>(*seen_, [&](Entity entity, const WorldTransform&) {
        const uint32_t index = entity.index < instanceOf_.size() ? instanceOf_[entity.index] : kNone;
        lit |= index == kLit;
        if (index < kLit) moved.emplace_back(index, entity);
    });
    if (lit) return false;

    std::vector<std::pair<uint32_t, shared::Instance>> placed;
    std::vector<uint32_t> indices;
    placed.reserve(moved.size());
    indices.reserve(moved.size());
    for (const auto& [index, entity] : moved) {
        shared::Instance instance = instances_.values()[index];
        const SphereInstance* sphere = scene_.world.find<SphereInstance>(entity);
        place(instance, traced_[index], *scene_.world.find<WorldTransform>(entity),
              sphere ? ballOf(*sphere) : glm::dmat4(1));
        facts_.dynamicInstances += instance.worldFromLocal != instance.previousWorldFromLocal ? 1 : 0;
        placed.emplace_back(index, instance);
        indices.push_back(index);
    }
    accel_.moveInstances(traced_, indices);
    if (instances_.replace(device_, placed)) ++facts_.lightingRevision;
    if (facts_.specularCasters > 0)
        casters_.assign(device_, findCasters(instances_.values(), materialIndices_.values()));
    updateTable(bounds);
    return true;
}

void GpuScene::updateInstances() {
    usedDistributions_.clear();
    instanceOf_.clear();
    turnovers_ = {};
    std::erase_if(lightIds_, [&](const auto& entry) {
        return !scene_.world.alive({static_cast<uint32_t>(entry.first), static_cast<uint32_t>(entry.first >> 32)});
    });
    Draft draft;
    addMeshes(draft);
    addSpheres(draft);
    addLights(draft);

    const Bounds bounds = scene_.bounds();
    LightTable lights = buildLightTable(draft.lights, draft.emissive, origin_, bounds.radius());
    for (size_t i = 0; i < draft.lights.size(); ++i)
        if (draft.lights[i].instance != kNone)
            draft.instances[draft.lights[i].instance].firstLight = lights.lightOfInput[i];
    for (size_t i = 0; i < draft.emissive.size(); ++i)
        draft.instances[draft.emissive[i].instance].firstLight = lights.firstLight[i];

    traced_ = std::move(draft.traced);
    accel_.setInstances(traced_);
    facts_.lights = static_cast<uint32_t>(lights.lights.size());
    updateFacts(draft);
    casters_.assign(device_, findCasters(draft.instances, draft.materialIndices));
    matchLights(lights_.values(), lights.lights);
    for (const shared::Light& light : lights.lights) {
        lightKinds_ |= 1u << light.kind;
        texturedLights_ |= light.distribution != kNone;
    }
    const bool lightsChanged = lights_.assign(device_, std::move(lights.lights));
    if (lightsChanged) facts_.changedLights = facts_.lights;
    alias_.assign(device_, std::move(lights.alias));
    lightOfTriangle_.assign(device_, std::move(lights.lightOfTriangle));
    distributions_.assign(device_, usedDistributions_);
    const bool instancesChanged = instances_.assign(device_, std::move(draft.instances));
    const bool bindingsChanged = materialIndices_.assign(device_, std::move(draft.materialIndices));
    if (lightsChanged || instancesChanged || bindingsChanged) ++facts_.lightingRevision;
    table_.infiniteLightCount = lights.infiniteCount;
    table_.lightPower = static_cast<float>(lights.power);
    updateTable(bounds);
    turnovers_ = turnovers(); // last: an update that failed is tried again
}

void GpuScene::updateTable(const Bounds& bounds) {
    table_.topNodes = accel_.topNodes();
    table_.topInstances = accel_.topInstances();
    table_.instances = instances_.address();
    table_.meshes = meshTable_.address();
    table_.materials = materials_.materials();
    table_.textureInputs = materials_.textureInputs();
    table_.materialIndices = materialIndices_.address();
    table_.lights = lights_.address();
    table_.lightAlias = alias_.address();
    table_.lightOfTriangle = lightOfTriangle_.address();
    table_.distributions = distributions_.address();
    table_.casters = casters_.address();
    table_.casterCount = casters_.size();
    table_.instanceCount = instances_.size();
    table_.lightCount = lights_.size();
    table_.boundsCenter = bounds.empty() ? glm::vec3(0) : glm::vec3(bounds.center() - origin_);
    table_.boundsRadius = static_cast<float>(bounds.radius());
    facts_.boundsMin = facts_.boundsMax = glm::vec3(0);
    if (!bounds.empty()) {
        facts_.boundsMin = glm::vec3(bounds.min - origin_);
        facts_.boundsMax = glm::vec3(bounds.max - origin_);
    }
}

void GpuScene::updateFacts(const Draft& draft) {
    facts_.instances = static_cast<uint32_t>(draft.instances.size());
    facts_.environment = std::any_of(draft.lights.begin(), draft.lights.end(),
                                     [](const LightInput& l) { return l.component->kind == LightKind::Dome; });
    facts_.textured = materials_.textured();
    facts_.rough = materials_.rough();
    facts_.transparent = materials_.cutouts() || materials_.transmissive();
    facts_.diffuseAlbedo = std::any_of(draft.materialIndices.begin(), draft.materialIndices.end(),
                                       [&](uint32_t material) { return materials_.isDiffuse(material); });
    for (const shared::Instance& instance : draft.instances)
        facts_.dynamicInstances += instance.worldFromLocal != instance.previousWorldFromLocal ? 1 : 0;
}

std::vector<shared::Caster> GpuScene::findCasters(std::span<const shared::Instance> instances,
                                                  std::span<const uint32_t> materialIndices) {
    facts_.specularCasters = 0;
    std::vector<shared::Caster> casters;
    for (size_t i = 0; i < instances.size(); ++i) {
        const shared::Instance& instance = instances[i];
        const size_t end = i + 1 < instances.size() ? instances[i + 1].firstMaterial : materialIndices.size();
        std::vector<Ball> balls;
        bool casts = false;
        for (size_t k = instance.firstMaterial; k < end; ++k) {
            if (!materials_.castsCaustics(materialIndices[k])) continue;
            casts = true;
            if (instance.shape == shared::kShapeSphere) balls.push_back({glm::dvec3(0), 1});
            if (instance.shape != shared::kShapeMesh) continue;
            const std::vector<Ball>& ofMesh = meshes_[instance.mesh].balls;
            const size_t subset = k - instance.firstMaterial;
            if (subset < ofMesh.size()) balls.push_back(ofMesh[subset]);
        }
        if (!casts) continue;
        ++facts_.specularCasters;
        casters.push_back(placeCaster(balls, glm::dmat4x3(instance.worldFromLocal)));
    }
    return groupCasters(std::move(casters));
}

} // namespace trilume
