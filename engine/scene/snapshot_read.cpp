#include "core/mapped_file.h"
#include "scene/snapshot.h"
#include "scene/snapshot_playback.h"

#include <fmt/core.h>

namespace trilume {
namespace snapshot {
namespace {

constexpr uint32_t kLargestTexture = 1 << 16; ///< pixels along a side

Header headerOf(std::span<const std::byte> file, const std::string& where) {
    const auto broken = [&](const char* what) { return damaged(what, where); };
    Header header{};
    if (file.size() < sizeof(header.magic) || std::memcmp(file.data(), kMagic.data(), sizeof(kMagic)) != 0)
        throw inputError("not a .tlscene file", where, "name one that `trilume cook` wrote");
    if (file.size() < sizeof(header)) throw broken("it ends too early");
    std::memcpy(&header, file.data(), sizeof(header));
    if (header.byteOrder != kByteOrder)
        throw inputError("the file was written by a machine with another byte order", where,
                         "cook the stage again on this one");
    if (header.version != kVersion)
        throw inputError(fmt::format("the file has format {}, this Trilume reads {}", header.version, kVersion), where,
                         "cook the stage again");
    if (header.fileBytes != file.size() || file.size() % kAlignment != 0) throw broken("it has another length");
    if (checksum(file.subspan(kUnchecked)) != header.checksum) throw broken("its checksum differs");
    for (const Range& range : header.sections)
        if (range.offset > file.size() || range.bytes > file.size() - range.offset || range.offset % kAlignment != 0)
            throw broken("a section beyond its end");
    return header;
}

/// Rays and refits follow it without looking: it has to be a tree over triangles that exist, as shallow as the tracer's
/// stack is deep.
void checkBvh(const MeshBvh& bvh, const Mesh& mesh, const Reader& reader) {
    const auto check = [&](bool good) { reader.check(good, "a BVH that is none"); };
    const size_t nodes = bvh.nodes.size();
    check(nodes > 0 && nodes <= shared::kBvhNodeLimit && bvh.order.size() <= mesh.triangles.size());
    for (const uint32_t triangle : bvh.order) check(triangle < mesh.triangles.size());
    std::vector<uint8_t> levels(nodes, 0); // 0: nobody's child yet
    levels[0] = 1;
    for (size_t i = 0; i < nodes; ++i) {
        check(levels[i] > 0 && levels[i] <= shared::kBvhMeshDepth);
        for (const uint32_t child : bvh.nodes[i].children) {
            if ((child & shared::kBvhLeafBit) == 0) {
                check(child > i && child < nodes && levels[child] == 0);
                levels[child] = levels[i] + 1;
            } else {
                const uint64_t first = child & shared::kBvhLeafFirstMask;
                check(first + (child >> shared::kBvhLeafCountShift & shared::kBvhLeafCountMask) <= bvh.order.size());
            }
        }
    }
}

void readTextures(Reader& reader, Scene& scene) {
    for (size_t n = reader.count(1); n > 0; --n) {
        auto texture = reader.read<Texture>();
        const size_t values = size_t{4} * texture.width * texture.height;
        const bool empty = texture.width == 0 || texture.height == 0;
        reader.check(!empty && texture.width <= kLargestTexture && texture.height <= kLargestTexture &&
                         (texture.rgba8.empty() ? texture.rgba32f.size() == values
                                                : texture.rgba8.size() == values && texture.rgba32f.empty()),
                     "a texture whose pixels do not fit its size");
        scene.addTexture(std::move(texture));
    }
}

void readMeshes(Reader& reader, Scene& scene) {
    for (size_t n = reader.count(1); n > 0; --n) {
        auto mesh = reader.read<Mesh>();
        checkMesh(mesh, scene.path);
        if (reader.read<bool>()) {
            const auto bvh = std::make_shared<MeshBvh>(reader.read<MeshBvh>());
            checkBvh(*bvh, mesh, reader);
            mesh.bvh = bvh;
        }
        scene.addMesh(std::move(mesh));
    }
}

/// Those that stand from the beginning are created in order; parents may come later.
std::vector<KnownEntity> readEntities(Reader& reader, Scene& scene) {
    const size_t standing = reader.count(1);
    std::vector<KnownEntity> entities;
    for (uint32_t i = 0; i < reader.counts().entities; ++i) {
        KnownEntity& entity = entities.emplace_back();
        reader(entity.path);
        reader(entity.parent);
    }
    reader.check(standing <= entities.size(), "entities that are not there");
    for (uint32_t i = 0; i < standing; ++i) entities[i].now = scene.world.create();
    for (uint32_t i = 0; i < standing; ++i) dress(scene, entities, i);
    return entities;
}

template<class C>
void readComponents(Reader& reader, Scene& scene, const std::vector<KnownEntity>& entities) {
    for (size_t n = reader.count(sizeof(uint32_t)); n > 0; --n) {
        const auto index = reader.read<uint32_t>();
        reader.check(index < entities.size() && entities[index].now, "a component of nothing");
        scene.world.add(entities[index].now, reader.read<C>());
    }
}

} // namespace
} // namespace snapshot

std::unique_ptr<Scene> readSnapshot(const std::filesystem::path& path) {
    using namespace snapshot;
    const MappedFile file(path);
    auto scene = std::make_unique<Scene>();
    scene->path = path.string();
    const Header header = headerOf(file.bytes(), scene->path);
    const auto open = [&](Section section, const Counts& counts) {
        return Reader(file.bytes(), header.sections[static_cast<size_t>(section)], scene->path, counts);
    };

    Reader info = open(Section::Info, {});
    const auto counts = info.read<Counts>();
    info(scene->startTime);
    info(scene->endTime);
    const bool restricted = info.read<bool>();
    info(scene->timeCodesPerSecond);
    info(scene->renderSettings.camera);
    info(scene->renderSettings.width);
    info(scene->renderSettings.height);

    Reader textures = open(Section::Textures, counts), materials = open(Section::Materials, counts);
    readTextures(textures, *scene);
    for (size_t n = materials.count(1); n > 0; --n) scene->addMaterial(materials.read<Material>());
    Reader meshes = open(Section::Meshes, counts), names = open(Section::Entities, counts);
    readMeshes(meshes, *scene);
    std::vector<KnownEntity> entities = readEntities(names, *scene);

    Reader tracks = open(Section::Tracks, counts);
    readTextures(tracks, *scene);
    for (size_t n = tracks.count(1); n > 0; --n) {
        Material material;
        tracks(material.name);
        scene->addMaterial(std::move(material));
    }
    for (size_t n = tracks.count(1); n > 0; --n) {
        Mesh mesh;
        tracks(mesh.name);
        tracks(mesh.deforming);
        scene->addMesh(std::move(mesh));
    }
    tracks.check(scene->textures().size() == counts.textures && scene->materials().size() == counts.materials &&
                     scene->meshes().size() == counts.meshes,
                 "counts that differ");

    Reader components = open(Section::Components, counts);
    readComponents<LocalTransform>(components, *scene, entities);
    readComponents<Visibility>(components, *scene, entities);
    readComponents<MeshInstance>(components, *scene, entities);
    readComponents<SphereInstance>(components, *scene, entities);
    readComponents<Light>(components, *scene, entities);
    readComponents<Camera>(components, *scene, entities);

    auto playback = std::make_unique<Playback>(*scene, std::move(entities), restricted, tracks);
    if (playback->varies()) scene->source = std::move(playback);
    return scene;
}

} // namespace trilume
