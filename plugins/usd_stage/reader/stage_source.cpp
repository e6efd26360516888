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
        if (const py::object record = read(item); !record.is_none())
            loadAsset(asset, item.attr("kind").cast<std::string>(), record);
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

void StageSource::loadAsset(Asset& asset, const std::string& kind, const py::object& record) {
    const auto find = [this](const auto&... key) { return findTexture(key...); };
    asset.usable = true;
    if (kind == "light") {
        asset.kind = Kind::Light;
        asset.light = lightFrom(record, find);
    } else if (kind == "camera") {
        asset.kind = Kind::Camera;
        asset.camera = cameraFrom(record);
    } else if (kind == "sphere") {
        asset.kind = Kind::Sphere;
        asset.sphere.radius = record["radius"].cast<float>();
    } else {
        Mesh mesh;
        mesh.name = asset.path;
        asset.usable = buildMeshOf(asset, record, mesh);
        if (asset.usable) asset.mesh = scene_.addMesh(std::move(mesh));
    }
}

bool StageSource::buildMeshOf(Asset& asset, const py::dict& record, Mesh& mesh) {
    if (record.contains("shape")) {
        shapeFrom(record, mesh);
        return true;
    }
    const MeshRecord mine(record);
    Problems problems;
    Topology topology = buildTopology(mine.polygons, problems);
    buildMesh(mine.polygons, topology, mesh, problems);
    for (const std::string& problem : problems) log::warning("{}: {}: {}", scene_.path, asset.path, problem);
    if (mesh.triangles.empty()) log::warning("{}: {}: the mesh has no usable face: left out", scene_.path, asset.path);
    const bool usable = !mesh.triangles.empty();
    if (mesh.deforming && mine.sameTopology) asset.topology = std::move(topology);
    return usable;
}

void StageSource::updateAsset(Asset& asset, const py::object& record) {
    if (record.is_none() || !asset.usable) return;
    const auto find = [this](const auto&... key) { return findTexture(key...); };
    switch (asset.kind) {
    case Kind::Mesh:
        return updateMesh(asset, record);
    case Kind::Sphere:
        asset.sphere.radius = record["radius"].cast<float>();
        break;
    case Kind::Light:
        asset.light = lightFrom(record, find);
        break;
    case Kind::Camera:
        asset.camera = cameraFrom(record);
        break;
    }
    for (size_t number : asset.placements)
        for (Entity entity : placements_[number].entities) assignComponent(asset, placements_[number], entity);
}

void StageSource::updateMesh(Asset& asset, const py::dict& record) {
    Mesh& mesh = scene_.editMesh(asset.mesh);
    if (!record.contains("shape")) {
        const MeshRecord mine(record);
        if (mine.sameTopology) {
            Problems problems;
            if (updatePoints(mine.polygons, asset.topology, mesh, problems)) ++mesh.pointsRevision;
            for (const std::string& problem : problems)
                log::writeOnce(log::Level::Warning, asset.path + problem,
                               fmt::format("{}: {}: {}", scene_.path, asset.path, problem));
            return;
        }
    }
    Mesh remodelled;
    remodelled.name = asset.path;
    if (!buildMeshOf(asset, record, remodelled)) return; // warned; the last shape stays
    const bool topologyChanged = remodelled.triangles != mesh.triangles || remodelled.uvs != mesh.uvs ||
                                 remodelled.triangleSubset != mesh.triangleSubset ||
                                 remodelled.positions.size() != mesh.positions.size();
    const bool pointsChanged = remodelled.positions != mesh.positions || remodelled.normals != mesh.normals;
    remodelled.topologyRevision = mesh.topologyRevision + topologyChanged;
    remodelled.pointsRevision = mesh.pointsRevision + (pointsChanged || topologyChanged);
    mesh = std::move(remodelled);
}

void StageSource::loadPlacement(const py::object& description) {
    const size_t number = placements_.size();
    Placement& placement = placements_.emplace_back();
    placement.asset = description.attr("asset").cast<size_t>();
    for (size_t material : description.attr("materials").cast<std::vector<size_t>>())
        placement.materials.push_back(materials_[material]);
    Asset& asset = assets_[placement.asset];
    if (!asset.usable) return;
    asset.placements.push_back(number);
    place(number, stage_.attr("sample")(description));
}

/// Copies that are hidden and always will be make no entities.
void StageSource::place(size_t number, const py::object& sampled) {
    Placement& placement = placements_[number];
    const Asset& asset = assets_[placement.asset];
    if (!asset.usable || sampled.is_none()) return;
    const py::tuple sample = sampled;
    const py::object matrices = sample[0], visible = sample[1];
    const std::span<const double> values = viewOf<double>(matrices);
    const std::span<const bool> shown = viewOf<bool>(visible);
    const py::object description = stage_.attr("placements")[py::int_(number)];
    const bool varying = description.attr("varying").cast<bool>();
    // With a time-varying transform, scaling to nothing is a way to hide.
    if (const auto name = sample[2].cast<std::string>(); !name.empty() && !varying)
        log::warning("{}: {}: its transform is singular or not finite: left out", scene_.path, name);

    while (placement.entities.size() > shown.size()) {
        scene_.world.destroy(placement.entities.back());
        placement.entities.pop_back();
    }
    std::vector<std::string> names;
    if (placement.entities.size() < shown.size())
        names = stage_.attr("names")(description).cast<std::vector<std::string>>();
    for (size_t i = 0; i < shown.size(); ++i) {
        if (i == placement.entities.size())
            placement.entities.push_back(shown[i] || varying ? createCopy(placement, std::move(names[i])) : Entity{});
        const Entity entity = placement.entities[i];
        if (!entity) continue;
        const glm::dmat4 stageFromLocal = glm::make_mat4(&values[16 * i]);
        assign(scene_.world, entity, LocalTransform{localTransform(asset, stageFromLocal)});
        if (!shown[i] || scene_.world.find<Visibility>(entity)) assign(scene_.world, entity, Visibility{shown[i]});
    }
}

Entity StageSource::createCopy(const Placement& placement, std::string name) {
    const Asset& asset = assets_[placement.asset];
    const Entity parent = asset.kind == Kind::Camera ? Entity{} : root_;
    const Entity entity = scene_.createEntity(std::move(name), glm::dmat4(1), parent);
    assignComponent(asset, placement, entity);
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
        logWarnings();
    } catch (const py::error_already_set& e) {
        throw runError(fmt::format("the stage can't be read at time {} ({})", timeCode, reasonOf(e)), scene_.path,
                       "check the time samples there");
    }
}

TextureId StageSource::findTexture(const std::string& file, ColorSpace space, Wrap s, Wrap t) {
    const auto [entry, isNew] = textures_.try_emplace({file, space, s, t}, TextureId::None);
    if (!isNew) return entry->second;
    try {
        Texture texture = readTexture_(file, space);
        texture.wrapS = s;
        texture.wrapT = t;
        entry->second = scene_.addTexture(std::move(texture));
    } catch (const Error& e) {
        log::warning("{}: {}: {}: a constant is used", scene_.path, e.where(), e.problem());
    }
    return entry->second;
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
