#include "stage_source.h"

#include "core/error.h"
#include "core/log.h"
#include "records.h"

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <pybind11/stl.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace trilume::usd {
namespace {

bool same(const Light& a, const Light& b) {
    return a.kind == b.kind && a.radiance == b.radiance && a.width == b.width && a.height == b.height &&
           a.radius == b.radius && a.length == b.length && a.angle == b.angle && a.normalize == b.normalize &&
           a.texture == b.texture && a.visibleToCamera == b.visibleToCamera;
}
bool same(const Camera& a, const Camera& b) {
    return a.verticalAperture == b.verticalAperture && a.horizontalAperture == b.horizontalAperture &&
           a.horizontalOffset == b.horizontalOffset && a.verticalOffset == b.verticalOffset &&
           a.focalLength == b.focalLength && a.nearClip == b.nearClip && a.farClip == b.farClip && a.fStop == b.fStop &&
           a.focusDistance == b.focusDistance;
}
bool same(const SphereInstance& a, const SphereInstance& b) { return a.radius == b.radius && a.material == b.material; }
bool same(const MeshInstance& a, const MeshInstance& b) { return a.mesh == b.mesh && a.materials == b.materials; }
bool same(const LocalTransform& a, const LocalTransform& b) { return a.parentFromLocal == b.parentFromLocal; }
bool same(const Visibility& a, const Visibility& b) {
    return a.visible == b.visible && a.camera == b.camera && a.shadow == b.shadow;
}

/// The cause of a Python or USD error, without its source positions.
std::string reasonOf(const py::error_already_set& error) {
    return py::module_::import("trilume_usd.diagnostics").attr("reason")(error.value()).cast<std::string>();
}

/// Writes only what differs, so that change ticks mean changes.
template<class C>
void assign(World& world, Entity entity, C component) {
    if (const C* old = world.find<C>(entity); !old || !same(*old, component))
        world.add<C>(entity, std::move(component));
}

/// Directions of the axes without their lengths: a camera's scale has no meaning.
glm::dmat4 withoutScale(const glm::dmat4& m) {
    const glm::dvec3 z = glm::normalize(glm::dvec3(m[2]));
    const glm::dvec3 y = glm::normalize(glm::dvec3(m[1]) - z * glm::dot(z, glm::dvec3(m[1])));
    const glm::dvec3 x = glm::cross(y, z) * (glm::determinant(glm::dmat3(m)) < 0 ? -1.0 : 1.0);
    return {{x, 0}, {y, 0}, {z, 0}, m[3]};
}

} // namespace

StageSource::Kind StageSource::kindFrom(const std::string& name) {
    if (name == "light") return Kind::Light;
    if (name == "camera") return Kind::Camera;
    return name == "sphere" ? Kind::Sphere : Kind::Mesh;
}

StageSource::StageSource(py::object stage, Scene& scene, ReadTexture readTexture)
    : stage_(std::move(stage)), scene_(scene), readTexture_(std::move(readTexture)) {
    load();
}

StageSource::~StageSource() {
    if (!Py_IsInitialized()) { // the host has shut Python down: nothing of it may be touched
        stage_.release();
        for (py::object& record : materialRecords_) record.release();
        return;
    }
    py::gil_scoped_acquire lock;
    materialRecords_.clear();
    stage_ = py::object();
}

bool StageSource::varies() const { return stage_.attr("varying").cast<bool>(); }

void StageSource::load() {
    loadStageFacts();
    const py::object read = stage_.attr("read");
    for (const py::object& material : stage_.attr("materials").cast<std::vector<py::object>>())
        loadMaterial(materials_.size(), read(material), material.attr("path").cast<std::string>());
    for (const py::object& item : stage_.attr("assets").cast<std::vector<py::object>>()) {
        Asset& asset = assets_.emplace_back();
        asset.path = item.attr("path").cast<std::string>();
        asset.kind = kindFrom(item.attr("kind").cast<std::string>());
        asset.varying = item.attr("varying").cast<bool>();
        readAsset(asset, read(item));
    }
    for (const py::object& placement : stage_.attr("placements").cast<std::vector<py::object>>())
        loadPlacement(placement);
    logWarnings();
    checkVisible();
}

void StageSource::loadStageFacts() {
    const auto metersPerUnit = stage_.attr("meters_per_unit").cast<double>();
    worldFromStage_ = glm::scale(glm::dmat4(1), glm::dvec3(metersPerUnit));
    if (stage_.attr("z_up").cast<bool>())
        worldFromStage_ *= glm::dmat4({1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1});
    root_ = scene_.createEntity("/", worldFromStage_);
    scene_.timeCodesPerSecond = stage_.attr("time_codes_per_second").cast<double>();
    scene_.startTime = stage_.attr("start").cast<std::optional<double>>();
    scene_.endTime = stage_.attr("end").cast<std::optional<double>>();
    const auto settings = stage_.attr("render_settings")().cast<std::tuple<std::string, uint32_t, uint32_t>>();
    std::tie(scene_.renderSettings.camera, scene_.renderSettings.width, scene_.renderSettings.height) = settings;
}

void StageSource::loadMaterial(size_t number, const py::object& record, const std::string& path) {
    const auto find = [this](const auto&... key) { return findTexture(key...); };
    Material material;
    material.name = path;
    if (!record.is_none()) material = materialFrom(path, record, find);
    materials_.push_back(scene_.addMaterial(std::move(material)));
    materialRecords_.resize(number + 1);
    materialRecords_[number] = record;
}

void StageSource::updateMaterial(size_t number, const py::object& record) {
    if (record.is_none() || record.equal(materialRecords_[number])) return;
    materialRecords_[number] = record;
    const auto find = [this](const auto&... key) { return findTexture(key...); };
    Material material = materialFrom(scene_.material(materials_[number]).name, record, find);
    Material& old = scene_.editMaterial(materials_[number]);
    material.revision = old.revision;
    old = std::move(material);
}

/// Without a record the asset is not there at the present time.
void StageSource::readAsset(Asset& asset, const py::object& record) {
    const auto find = [this](const auto&... key) { return findTexture(key...); };
    asset.present = !record.is_none();
    if (!asset.present) return;
    switch (asset.kind) {
    case Kind::Mesh:
        return readMesh(asset, record);
    case Kind::Sphere:
        asset.sphere.radius = py::dict(record)["radius"].cast<float>();
        break;
    case Kind::Light:
        asset.light = lightFrom(record, find);
        break;
    case Kind::Camera:
        asset.camera = cameraFrom(record);
        break;
    }
}

void StageSource::readMesh(Asset& asset, const py::dict& record) {
    if (followPoints(asset, record)) return;
    Mesh mesh = buildMeshOf(asset, record);
    asset.present = !mesh.triangles.empty();
    if (!asset.present) return; // hidden: its old shape may stay
    if (asset.mesh == MeshId::None) {
        asset.mesh = scene_.addMesh(std::move(mesh));
        return;
    }
    Mesh& old = scene_.editMesh(asset.mesh);
    const bool topologyChanged = mesh.triangles != old.triangles || mesh.uvs != old.uvs ||
                                 mesh.triangleSubset != old.triangleSubset ||
                                 mesh.positions.size() != old.positions.size();
    const bool pointsChanged = mesh.positions != old.positions || mesh.normals != old.normals;
    mesh.topologyRevision = old.topologyRevision + topologyChanged;
    mesh.pointsRevision = old.pointsRevision + (pointsChanged || topologyChanged);
    old = std::move(mesh);
}

/// False when its faces have to be made anew.
bool StageSource::followPoints(Asset& asset, const py::dict& record) {
    if (asset.topology.triangles.empty() || record.contains("shape")) return false;
    const MeshRecord mine(record);
    if (mine.polygons.points.size() != asset.topology.pointCount) return false;
    Mesh& mesh = scene_.editMesh(asset.mesh);
    Problems problems;
    if (updatePoints(mine.polygons, asset.topology, mesh, problems)) ++mesh.pointsRevision;
    for (const Problem& problem : problems) logOnce(asset, problem);
    return true;
}

Mesh StageSource::buildMeshOf(Asset& asset, const py::dict& record) {
    Mesh mesh;
    mesh.name = asset.path;
    if (record.contains("shape")) {
        shapeFrom(record, mesh);
        return mesh;
    }
    const MeshRecord mine(record);
    const bool empty = mine.polygons.points.empty() || mine.polygons.counts.empty();
    if (empty && asset.varying) return mesh; // as simulations are before they begin
    Problems problems;
    Topology topology = buildTopology(mine.polygons, problems);
    buildMesh(mine.polygons, topology, mesh, problems);
    if (mesh.triangles.empty()) problems.push_back({0, "the mesh has no usable face: left out"});
    for (const Problem& problem : problems) logOnce(asset, problem);
    if (mesh.deforming && mine.sameTopology) asset.topology = std::move(topology);
    return mesh;
}

void StageSource::logOnce(const Asset& asset, const Problem& problem) {
    if (logged_.emplace(asset.path, problem.what).second)
        log::warning("{}: {}: {}", scene_.path, asset.path, problem.text());
}

void StageSource::updateAsset(Asset& asset, const py::object& record) {
    const bool before = asset.present;
    readAsset(asset, record);
    for (size_t number : asset.placements) {
        const Placement& placement = placements_[number];
        if (asset.present)
            for (Entity entity : placement.entities) assignComponent(asset, placement, entity);
        if (asset.present != before) place(number, stage_.attr("sample")(placementAt(number)));
    }
}

void StageSource::loadPlacement(const py::object& description) {
    const size_t number = placements_.size();
    Placement& placement = placements_.emplace_back();
    placement.asset = description.attr("asset").cast<size_t>();
    for (size_t material : description.attr("materials").cast<std::vector<size_t>>())
        placement.materials.push_back(materials_[material]);
    assets_[placement.asset].placements.push_back(number);
    place(number, stage_.attr("sample")(description));
}

/// Copies that are hidden and always will be make no entities.
void StageSource::place(size_t number, const py::object& sampled) {
    Placement& placement = placements_[number];
    const Asset& asset = assets_[placement.asset];
    if (sampled.is_none() || !(asset.present || asset.varying)) return;
    const py::tuple sample = sampled;
    const py::object matrices = sample[0], visible = sample[1];
    const std::span<const double> values = viewOf<double>(matrices);
    const std::span<const bool> shown = viewOf<bool>(visible);
    const py::object description = placementAt(number);
    const bool moving = description.attr("varying").cast<bool>();
    // With a time-varying transform, scaling to nothing is a way to hide.
    if (const auto name = sample[2].cast<std::string>(); !name.empty() && !moving)
        log::warning("{}: {}: its transform is singular or not finite: left out", scene_.path, name);

    while (placement.entities.size() > shown.size()) {
        scene_.world.destroy(placement.entities.back());
        placement.entities.pop_back();
    }
    std::vector<std::string> names;
    if (placement.entities.size() < shown.size())
        names = stage_.attr("names")(description).cast<std::vector<std::string>>();
    for (size_t i = 0; i < shown.size(); ++i) {
        const bool visible = shown[i] && asset.present;
        if (i == placement.entities.size())
            placement.entities.push_back(visible || moving || asset.varying ? createCopy(placement, std::move(names[i]))
                                                                            : Entity{});
        const Entity entity = placement.entities[i];
        if (!entity) continue;
        const glm::dmat4 stageFromLocal = glm::make_mat4(&values[16 * i]);
        assign(scene_.world, entity, LocalTransform{localTransform(asset, stageFromLocal)});
        if (!visible || scene_.world.find<Visibility>(entity)) assign(scene_.world, entity, Visibility{visible});
    }
}

py::object StageSource::placementAt(size_t number) const { return stage_.attr("placements")[py::int_(number)]; }

Entity StageSource::createCopy(const Placement& placement, std::string name) {
    const Asset& asset = assets_[placement.asset];
    const Entity parent = asset.kind == Kind::Camera ? Entity{} : root_;
    const Entity entity = scene_.createEntity(std::move(name), glm::dmat4(1), parent);
    if (asset.present) assignComponent(asset, placement, entity);
    return entity;
}

void StageSource::assignComponent(const Asset& asset, const Placement& placement, Entity entity) {
    World& world = scene_.world;
    switch (asset.kind) {
    case Kind::Mesh:
        return assign(world, entity, MeshInstance{asset.mesh, placement.materials});
    case Kind::Light:
        return assign(world, entity, asset.light);
    case Kind::Camera:
        return assign(world, entity, asset.camera);
    case Kind::Sphere:
        break;
    }
    SphereInstance sphere = asset.sphere;
    if (!placement.materials.empty()) sphere.material = placement.materials.front();
    assign(world, entity, sphere);
}

/// Cameras stand in the world themselves, without the stage's scale; everything else below the root entity.
glm::dmat4 StageSource::localTransform(const Asset& asset, const glm::dmat4& stageFromLocal) const {
    return asset.kind == Kind::Camera ? withoutScale(worldFromStage_ * stageFromLocal) : stageFromLocal;
}

void StageSource::setTime(double timeCode) {
    py::gil_scoped_acquire lock;
    try {
        const py::tuple changes = stage_.attr("update")(timeCode);
        const auto each = [&](size_t kind, auto&& apply) {
            for (const py::tuple& change : changes[kind].cast<std::vector<py::tuple>>())
                apply(change[0].cast<size_t>(), change[1]);
        };
        each(0, [&](size_t number, const py::object& record) { updateMaterial(number, record); });
        each(1, [&](size_t number, const py::object& record) { updateAsset(assets_[number], record); });
        each(2, [&](size_t number, const py::object& sample) { place(number, sample); });
        if (std::exchange(texturesAdded_, false)) releaseTextures();
        logWarnings();
    } catch (const py::error_already_set& e) {
        throw runError(fmt::format("the stage can't be read at time {} ({})", timeCode, reasonOf(e)), scene_.path,
                       "check the time samples there");
    }
}

std::vector<double> StageSource::sampleTimes() const {
    py::gil_scoped_acquire lock;
    try {
        return stage_.attr("sample_times")().cast<std::vector<double>>();
    } catch (const py::error_already_set& e) {
        throw runError(fmt::format("the stage's time samples can't be read ({})", reasonOf(e)), scene_.path,
                       "check it with usdchecker");
    }
}

TextureId StageSource::findTexture(const std::string& file, ColorSpace space, std::optional<Wrap> s,
                                   std::optional<Wrap> t) {
    const auto [entry, isNew] = textures_.try_emplace({file, space, s, t}, TextureId::None);
    if (!isNew) return entry->second;
    try {
        Texture texture = readTexture_(file, space);
        texture.wrapS = s.value_or(texture.wrapS);
        texture.wrapT = t.value_or(texture.wrapT);
        entry->second = placeTexture(std::move(texture));
    } catch (const Error& e) {
        log::warning("{}: {}: {}: a constant is used", scene_.path, e.where(), e.problem());
    }
    return entry->second;
}

TextureId StageSource::placeTexture(Texture texture) {
    texturesAdded_ = true;
    if (freeTextures_.empty()) return scene_.addTexture(std::move(texture));
    const TextureId id = freeTextures_.back();
    freeTextures_.pop_back();
    Texture& old = scene_.editTexture(id);
    texture.revision = old.revision;
    old = std::move(texture);
    return id;
}

/// What nothing names any more gives its place to later ones: files that change with time would pile up.
void StageSource::releaseTextures() {
    std::set<TextureId> used;
    for (const Material& m : scene_.materials())
        for (const TextureInput* map :
             {&m.baseColorMap, &m.metallicMap, &m.roughnessMap, &m.emissionMap, &m.opacityMap, &m.normalMap,
              &m.specularColorMap, &m.clearcoatMap, &m.clearcoatRoughnessMap, &m.transmissionMap})
            used.insert(map->texture);
    for (const Asset& asset : assets_) used.insert(asset.light.texture);
    std::erase_if(textures_, [&](const auto& entry) {
        const bool free = entry.second != TextureId::None && !used.contains(entry.second);
        if (free) freeTextures_.push_back(entry.second);
        return free;
    });
}

void StageSource::logWarnings() {
    for (const std::string& line : stage_.attr("warn").attr("take")().cast<std::vector<std::string>>())
        log::warning("{}: {}", scene_.path, line);
}

/// Never silently black.
void StageSource::checkVisible() const {
    bool geometry = false, lamp = false;
    for (const Placement& placement : placements_) {
        const Asset& asset = assets_[placement.asset];
        const bool stands =
            std::any_of(placement.entities.begin(), placement.entities.end(), [](Entity e) { return bool(e); });
        geometry |= stands && (asset.kind == Kind::Mesh || asset.kind == Kind::Sphere);
        lamp |= stands && asset.kind == Kind::Light && asset.light.kind != LightKind::Distant;
    }
    if (geometry) return;
    if (!lamp)
        throw inputError("the stage has no geometry that can be shown", scene_.path,
                         "add a Mesh or an implicit shape with purpose default or render, visible and usable");
    log::warning("{}: the stage has lights but no geometry", scene_.path);
}

std::unique_ptr<Scene> readStage(const std::filesystem::path& path, const ReadTexture& readTexture) {
    ensurePython();
    py::gil_scoped_acquire lock;
    const py::module_ reader = importReader();
    auto scene = std::make_unique<Scene>();
    scene->path = path.string();
    try {
        auto source = std::make_unique<StageSource>(reader.attr("Stage")(path.string()), *scene, readTexture);
        if (source->varies()) scene->source = std::move(source);
    } catch (py::error_already_set& e) {
        if (e.matches(reader.attr("StageError")))
            throw inputError(e.value().attr("problem").cast<std::string>(), path.string(),
                             e.value().attr("hint").cast<std::string>());
        throw runError(fmt::format("the stage can't be read ({})", reasonOf(e)), path.string(),
                       "check it with usdchecker");
    }
    return scene;
}

} // namespace trilume::usd
