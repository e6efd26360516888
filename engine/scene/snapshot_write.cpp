#include "core/error.h"
#include "core/file.h"
#include "scene/snapshot.h"
#include "scene/snapshot_bake.h"

#include <cmath>

namespace trilume {
namespace snapshot {
namespace {

constexpr double kMostTimes = 100'000;

struct Times {
    std::vector<double> all;
    std::vector<double> samples; ///< those of `all` between which values are interpolated
};

Times timesOf(const Scene& scene, std::span<const double> frames) {
    if (!scene.source) return {};
    std::set<double> samples, all;
    for (const double time : scene.source->sampleTimes()) samples.insert(time);
    if (!frames.empty()) {
        const auto [first, last] = std::minmax_element(frames.begin(), frames.end());
        samples.insert({*first, *last});
        samples.erase(samples.begin(), samples.find(*first));
        samples.erase(std::next(samples.find(*last)), samples.end());
        all.insert(frames.begin(), frames.end());
    } else if (!samples.empty()) {
        const double first = std::ceil(*samples.begin()), last = std::floor(*samples.rbegin());
        if (!(last - first < kMostTimes))
            throw inputError("the samples span too many frames", scene.path,
                             "name those that matter, for example --frames 1:240");
        for (double frame = first; frame <= last; ++frame) all.insert(frame);
    }
    all.insert(samples.begin(), samples.end());
    return {{all.begin(), all.end()}, {samples.begin(), samples.end()}};
}

template<class C>
void writeComponents(Writer& writer, const Scene& scene, const EntityList& entities) {
    writer(uint64_t{scene.world.count<C>()});
    scene.world.each<C>([&](Entity entity, const C& component) {
        writer(entities.indexOf(entity));
        writer(component);
    });
}

void writeMeshes(Writer& writer, const Scene& scene) {
    writer(uint64_t{scene.meshes().size()});
    for (const Mesh& mesh : scene.meshes()) {
        writer(mesh);
        const bool built = mesh.bvh && mesh.bvh->topologyRevision == mesh.topologyRevision &&
                           mesh.bvh->pointsRevision == mesh.pointsRevision;
        writer(built);
        if (built) writer(*mesh.bvh);
    }
}

template<class T>
void writeList(Writer& writer, std::span<const T> values) {
    writer(uint64_t{values.size()});
    for (const T& value : values) writer(value);
}

/// As it stands, before time moves it.
void writeState(Writer& writer, const Scene& scene, const EntityList& entities) {
    writer.begin(Section::Textures);
    writeList(writer, scene.textures());
    writer.begin(Section::Materials);
    writeList(writer, scene.materials());
    writer.begin(Section::Meshes);
    writeMeshes(writer, scene);
    writer.begin(Section::Components);
    writeComponents<LocalTransform>(writer, scene, entities);
    writeComponents<Visibility>(writer, scene, entities);
    writeComponents<MeshInstance>(writer, scene, entities);
    writeComponents<SphereInstance>(writer, scene, entities);
    writeComponents<Light>(writer, scene, entities);
    writeComponents<Camera>(writer, scene, entities);
}

SnapshotSummary summaryOf(const Scene& scene) {
    SnapshotSummary summary{.instances = scene.world.count<MeshInstance>() + scene.world.count<SphereInstance>(),
                            .materials = scene.materials().size(),
                            .lights = scene.world.count<Light>(),
                            .cameras = scene.world.count<Camera>()};
    for (const Mesh& mesh : scene.meshes()) summary.triangles += mesh.triangles.size();
    return summary;
}

void writeInfo(Writer& writer, const Scene& scene, std::span<const double> frames, const Counts& counts) {
    std::optional<double> start = scene.startTime, end = scene.endTime;
    if (!frames.empty()) {
        const auto [first, last] = std::minmax_element(frames.begin(), frames.end());
        start = *first;
        end = *last;
    }
    writer.begin(Section::Info);
    writer(counts);
    writer(start);
    writer(end);
    writer(!frames.empty());
    writer(scene.timeCodesPerSecond);
    writer(scene.renderSettings.camera);
    writer(scene.renderSettings.width);
    writer(scene.renderSettings.height);
}

} // namespace
} // namespace snapshot

SnapshotSummary writeSnapshot(Scene& scene, const std::filesystem::path& path, std::span<const double> frames) {
    using namespace snapshot;
    const Times times = timesOf(scene, frames);
    Writer writer;
    EntityList entities(scene);
    TextureList textures(scene);
    SnapshotSummary summary = summaryOf(scene);
    const size_t entitiesNow = entities.size(), materialsNow = scene.materials().size(),
                 meshesNow = scene.meshes().size();
    writeState(writer, scene, entities);

    Bake bake(scene, entities, textures);
    if (!times.all.empty()) bake.run(times.all, times.samples);
    writer.begin(Section::Entities);
    writer(uint64_t{entitiesNow});
    for (uint32_t i = 0; i < entities.size(); ++i) {
        writer(entities.path(i));
        writer(entities.parent(i));
    }
    writer.begin(Section::Tracks);
    writeList<Texture>(writer, textures.late());
    writer(uint64_t{scene.materials().size() - materialsNow});
    for (const Material& material : scene.materials().subspan(materialsNow)) writer(material.name);
    writer(uint64_t{scene.meshes().size() - meshesNow});
    for (const Mesh& mesh : scene.meshes().subspan(meshesNow)) {
        writer(mesh.name);
        writer(mesh.deforming);
    }
    bake.write(writer);
    writeInfo(writer, scene, frames,
              {.textures = static_cast<uint32_t>(textures.size()),
               .materials = static_cast<uint32_t>(scene.materials().size()),
               .meshes = static_cast<uint32_t>(scene.meshes().size()),
               .entities = static_cast<uint32_t>(entities.size())});
    const std::span<const std::byte> bytes = writer.finish();
    writeFileAtomically(path, bytes);

    summary.bytes = bytes.size();
    summary.meshes = scene.meshes().size();
    summary.textures = textures.size();
    summary.tracks = bake.tracks();
    summary.keys = bake.keys();
    return summary;
}

} // namespace trilume
