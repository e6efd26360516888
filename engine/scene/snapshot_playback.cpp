#include "scene/snapshot_playback.h"

#include "core/log.h"
#include "scene/snapshot_track.h"

#include <fmt/core.h>

#include <set>

namespace trilume::snapshot {
namespace {

// Each writes only what differs, so that changes follow time as those of the stage do.

void assign(Playback& playback, uint32_t target, const Existence& value) { playback.setAlive(target, value.alive); }

template<class C>
void assign(Playback& playback, uint32_t target, C value) {
    const Entity entity = playback.entity(target).now;
    if (!entity) return;
    const C* old = playback.scene().world.find<C>(entity);
    if (!old && std::same_as<C, Visibility> && same(value, C{})) return;
    if (!old || !same(*old, value)) playback.scene().world.add(entity, std::move(value));
}

void assign(Playback& playback, uint32_t target, Material value) {
    const auto id = static_cast<MaterialId>(target);
    if (same(playback.scene().material(id), value)) return;
    Material& old = playback.scene().editMaterial(id);
    value.revision = old.revision;
    old = std::move(value);
}

void assign(Playback& playback, uint32_t target, MeshTopology value) {
    Mesh& mesh = playback.scene().editMesh(static_cast<MeshId>(target));
    Same compare;
    topologyFields(compare, mesh, value);
    if (compare.equal) return;
    mesh.triangles = std::move(value.triangles);
    mesh.uvs = std::move(value.uvs);
    mesh.triangleSubset = std::move(value.triangleSubset);
    ++mesh.topologyRevision;
    ++mesh.pointsRevision;
}

void assign(Playback& playback, uint32_t target, MeshPoints value) {
    Mesh& mesh = playback.scene().editMesh(static_cast<MeshId>(target));
    Same compare;
    pointFields(compare, mesh, value);
    if (compare.equal) return;
    mesh.positions = std::move(value.positions);
    mesh.normals = std::move(value.normals);
    ++mesh.pointsRevision;
}

template<class T>
class TrackPlayer final : public Player {
public:
    TrackPlayer(Reader& reader, uint32_t targets) {
        reader(track_.target);
        reader.check(track_.target < targets, "a track of nothing");
        reader(track_.times);
        reader(track_.blends);
        reader(track_.values);
        const size_t keys = track_.times.size();
        reader.check(keys > 0 && track_.blends.size() == keys && track_.values.size() == keys, "a track without end");
        for (size_t i = 0; i < keys; ++i) {
            const double after = i == 0 ? std::numeric_limits<double>::lowest() : track_.times[i - 1];
            reader.check(track_.times[i] > after && std::isfinite(track_.times[i]), "times out of order");
        }
    }

    void apply(Playback& playback, double time) const override { assign(playback, track_.target, track_.at(time)); }
    void addTimes(std::vector<double>& times) const override {
        times.insert(times.end(), track_.times.begin(), track_.times.end());
    }

private:
    Track<T> track_;
};

std::unique_ptr<Player> readPlayer(Reader& reader) {
    const Counts& counts = reader.counts();
    switch (reader.read<Target>()) {
    case Target::Existence:
        return std::make_unique<TrackPlayer<Existence>>(reader, counts.entities);
    case Target::LocalTransform:
        return std::make_unique<TrackPlayer<LocalTransform>>(reader, counts.entities);
    case Target::Visibility:
        return std::make_unique<TrackPlayer<Visibility>>(reader, counts.entities);
    case Target::MeshInstance:
        return std::make_unique<TrackPlayer<MeshInstance>>(reader, counts.entities);
    case Target::SphereInstance:
        return std::make_unique<TrackPlayer<SphereInstance>>(reader, counts.entities);
    case Target::Light:
        return std::make_unique<TrackPlayer<Light>>(reader, counts.entities);
    case Target::Camera:
        return std::make_unique<TrackPlayer<Camera>>(reader, counts.entities);
    case Target::Material:
        return std::make_unique<TrackPlayer<Material>>(reader, counts.materials);
    case Target::MeshTopology:
        return std::make_unique<TrackPlayer<MeshTopology>>(reader, counts.meshes);
    case Target::MeshPoints:
        return std::make_unique<TrackPlayer<MeshPoints>>(reader, counts.meshes);
    }
    return {};
}

} // namespace

void dress(Scene& scene, const std::vector<KnownEntity>& entities, uint32_t index) {
    const KnownEntity& known = entities[index];
    scene.world.add(known.now, Name{known.path});
    if (known.parent < entities.size() && entities[known.parent].now)
        scene.world.add(known.now, Parent{entities[known.parent].now});
}

void checkMesh(const Mesh& mesh, const std::string& where) {
    const size_t triangles = mesh.triangles.size(), points = mesh.positions.size();
    const auto perTriangle = [&](size_t size, size_t each) { return size == 0 || size == each * triangles; };
    uint32_t highest = 0, highestSubset = 0;
    for (const glm::uvec3& t : mesh.triangles) highest = std::max({highest, t.x, t.y, t.z});
    for (const uint32_t subset : mesh.triangleSubset) highestSubset = std::max(highestSubset, subset);
    if ((triangles > 0 && highest >= points) || !perTriangle(mesh.normals.size(), 3) ||
        !perTriangle(mesh.uvs.size(), 3) || !perTriangle(mesh.triangleSubset.size(), 1) || highestSubset > triangles)
        throw damaged("a mesh whose arrays do not fit", where);
}

Playback::Playback(Scene& scene, std::vector<KnownEntity> entities, bool restricted, Reader& reader)
    : scene_(scene), entities_(std::move(entities)), restricted_(restricted) {
    for (size_t n = reader.count(sizeof(Target)); n > 0; --n) players_.push_back(readPlayer(reader));
    for (const Mesh& mesh : scene.meshes()) checked_.emplace_back(mesh.topologyRevision, mesh.pointsRevision);
}

void Playback::setTime(double timeCode) {
    if (restricted_ && (timeCode < scene_.startTime.value_or(timeCode) || timeCode > scene_.endTime.value_or(timeCode)))
        log::writeOnce(log::Level::Warning, scene_.path,
                       fmt::format("{}: time {:g} is outside what was cooked: the nearest that was is shown",
                                   scene_.path, timeCode));
    for (const auto& player : players_) player->apply(*this, timeCode);
    for (size_t i = 0; i < checked_.size(); ++i) {
        const Mesh& mesh = scene_.meshes()[i];
        const std::pair revisions(mesh.topologyRevision, mesh.pointsRevision);
        if (revisions == checked_[i]) continue;
        checkMesh(mesh, scene_.path);
        checked_[i] = revisions;
    }
}

std::vector<double> Playback::sampleTimes() const {
    std::vector<double> times;
    for (const auto& player : players_) player->addTimes(times);
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
}

void Playback::setAlive(uint32_t index, bool alive) {
    Entity& now = entities_[index].now;
    if (alive == bool(now)) return;
    if (alive) {
        now = scene_.world.create();
        dress(scene_, entities_, index);
    } else {
        scene_.world.destroy(std::exchange(now, {}));
    }
}

} // namespace trilume::snapshot
