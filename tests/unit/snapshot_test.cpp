#include "core/error.h"
#include "core/file.h"
#include "render/prebuilt_bvh.h"
#include "scene/snapshot.h"
#include "scene/snapshot_format.h"
#include "scene/snapshot_playback.h"
#include "scene/snapshot_track.h"

#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include <unistd.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>

// .tlscene: what is read is what was written, tracks follow their source, and no file whatever harms the reader.
namespace trilume {
namespace {

namespace fs = std::filesystem;

/// Moves a scene as a function says.
class Script final : public SceneSource {
public:
    Script(std::vector<double> samples, std::function<void(double)> play)
        : samples_(std::move(samples)), play_(std::move(play)) {}
    void setTime(double time) override { play_(time); }
    std::vector<double> sampleTimes() const override { return samples_; }

private:
    std::vector<double> samples_;
    std::function<void(double)> play_;
};

Mesh square(float z) {
    Mesh mesh;
    mesh.name = "/square";
    mesh.positions = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.normals.assign(6, {0, 0, 1});
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    mesh.triangleSubset = {0, 1};
    return mesh;
}

Texture checker() {
    Texture texture;
    texture.name = "checker.png";
    texture.width = 2;
    texture.height = 1;
    texture.rgba8 = {255, 0, 0, 255, 0, 255, 0, 128};
    texture.srgb = true;
    texture.wrapS = Wrap::Mirror;
    return texture;
}

/// One of everything, each value another than the default.
std::unique_ptr<Scene> everything() {
    auto scene = std::make_unique<Scene>();
    scene->startTime = 1;
    scene->endTime = 4;
    scene->timeCodesPerSecond = 30;
    scene->renderSettings = {"/cam", 640, 360};
    const TextureId image = scene->addTexture(checker());
    Texture linear{.name = "sky.exr", .width = 1, .height = 1, .rgba32f = {1, 2, 3, 1}};
    const TextureId sky = scene->addTexture(linear);
    Material material;
    material.name = "/paint";
    material.baseColor = {0.1f, 0.2f, 0.3f};
    material.specularWorkflow = true;
    material.transmission = 0.25f;
    material.emission = {1, 0, 2};
    material.baseColorMap = {.texture = image, .channel = 2, .scale = glm::vec4(2), .bias = glm::vec4(-1)};
    material.baseColorMap.uvTransform = {1, 2, 3, 4, 5, 6};
    const MaterialId paint = scene->addMaterial(material);
    const MeshId mesh = scene->addMesh(square(0));
    const Entity root = scene->createEntity("/", glm::scale(glm::dmat4(1), glm::dvec3(0.01)));
    const auto at = [](double x) { return glm::translate(glm::dmat4(1), {x, 0.1, 0}); };
    const Entity instance = scene->createEntity("/a", at(1), root);
    scene->world.add(instance, MeshInstance{mesh, {paint, MaterialId::None}});
    scene->world.add(instance, Visibility{.visible = false, .camera = false});
    scene->world.add(scene->createEntity("/ball", at(2), root), SphereInstance{.radius = 3, .material = paint});
    scene->world.add(scene->createEntity("/sky", at(3)),
                     Light{.kind = LightKind::Dome, .radiance = {1, 2, 3}, .texture = sky, .visibleToCamera = false});
    scene->world.add(scene->createEntity("/cam", at(4)), Camera{.focalLength = 35, .nearClip = 0.1f, .fStop = 2});
    buildMeshBvhs(*scene);
    return scene;
}

template<class C>
void expectSameComponents(const Scene& a, const Scene& b) {
    ASSERT_EQ(a.world.count<C>(), b.world.count<C>());
    std::vector<C> mine, theirs;
    a.world.each<C>([&](Entity, const C& c) { mine.push_back(c); });
    b.world.each<C>([&](Entity, const C& c) { theirs.push_back(c); });
    for (size_t i = 0; i < mine.size(); ++i) EXPECT_TRUE(snapshot::same(mine[i], theirs[i])) << i;
}

std::vector<std::string> names(const Scene& scene) {
    std::vector<std::string> list;
    scene.world.each<Name>([&](Entity entity, const Name& name) {
        const Parent* parent = scene.world.find<Parent>(entity);
        list.push_back(name.path + " in " + (parent ? scene.world.find<Name>(parent->entity)->path : "nothing"));
    });
    return list;
}

/// In the order of the scene's storage as well: pictures depend on it.
void expectSame(const Scene& a, const Scene& b) {
    EXPECT_EQ(names(a), names(b));
    expectSameComponents<LocalTransform>(a, b);
    expectSameComponents<Visibility>(a, b);
    expectSameComponents<MeshInstance>(a, b);
    expectSameComponents<SphereInstance>(a, b);
    expectSameComponents<Light>(a, b);
    expectSameComponents<Camera>(a, b);
    const auto expectSameAssets = [](auto mine, auto theirs) {
        ASSERT_EQ(mine.size(), theirs.size());
        for (size_t i = 0; i < mine.size(); ++i) EXPECT_TRUE(snapshot::same(mine[i], theirs[i])) << mine[i].name;
    };
    expectSameAssets(a.meshes(), b.meshes());
    expectSameAssets(a.materials(), b.materials());
}

class Snapshot : public ::testing::Test {
protected:
    void SetUp() override {
        const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() / ("trilume_snapshot_" + std::to_string(getpid()) + "_" + test->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path path() const { return folder_ / "scene.tlscene"; }
    std::vector<std::byte> written(Scene& scene, std::span<const double> frames = {}) const {
        writeSnapshot(scene, path(), frames);
        return readFile(path());
    }
    std::unique_ptr<Scene> roundTrip(Scene& scene, std::span<const double> frames = {}) const {
        writeSnapshot(scene, path(), frames);
        return readSnapshot(path());
    }
    /// The problem and the hint of the error, which has to name the file; empty: none.
    std::string errorOf(std::span<const std::byte> bytes) const {
        std::ofstream(path(), std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        try {
            const std::unique_ptr<Scene> scene = readSnapshot(path());
            exercise(*scene);
        } catch (const Error& e) {
            EXPECT_EQ(e.where(), path().string());
            EXPECT_EQ(e.fault(), Fault::Input);
            return e.problem() + ": " + e.hint();
        }
        return {};
    }
    /// Plays on after an error, each time twice: what setTime lets pass is sound. Throws the first error.
    static void exercise(Scene& scene) {
        std::optional<Error> error;
        for (const double time : {1.0, 1.0, 2.5, 2.5, 4.0, 4.0, -1e30, 1e30, 3.0, 3.0}) {
            try {
                scene.setTime(time);
            } catch (const Error& e) {
                if (!error) error = e;
                continue;
            }
            for (const Mesh& mesh : scene.meshes()) EXPECT_NO_THROW(snapshot::checkMesh(mesh, scene.path)) << time;
            scene.updateTransforms();
            (void)scene.bounds();
            (void)hasLight(scene);
        }
        if (error) throw *error;
    }

private:
    fs::path folder_;
};

template<class C>
const C& get(const Scene& scene, std::string_view path) {
    const C* found = nullptr;
    scene.world.each<Name>([&](Entity entity, const Name& name) {
        if (name.path == path) found = scene.world.find<C>(entity);
    });
    if (!found) throw std::runtime_error("nothing at " + std::string(path));
    return *found;
}

TEST_F(Snapshot, KeepsEverything) {
    const auto scene = everything();
    const auto read = roundTrip(*scene);
    expectSame(*scene, *read);
    ASSERT_EQ(read->textures().size(), 2u);
    for (size_t i = 0; i < 2; ++i) EXPECT_TRUE(snapshot::same(scene->textures()[i], read->textures()[i]));
    EXPECT_EQ(read->startTime, 1);
    EXPECT_EQ(read->endTime, 4);
    EXPECT_EQ(read->timeCodesPerSecond, 30);
    EXPECT_EQ(read->renderSettings.camera, "/cam");
    EXPECT_EQ(read->renderSettings.width, 640u);
    EXPECT_EQ(read->renderSettings.height, 360u);
    EXPECT_EQ(read->source, nullptr);
    EXPECT_EQ(read->path, path().string());
}

TEST_F(Snapshot, KeepsTheBvh) {
    const auto scene = everything();
    const auto read = roundTrip(*scene);
    const auto before = builtBvh(scene->meshes()[0]), after = builtBvh(read->meshes()[0]);
    ASSERT_TRUE(before && after);
    ASSERT_EQ(before->nodes.size(), after->nodes.size());
    EXPECT_EQ(std::memcmp(before->nodes.data(), after->nodes.data(), before->nodes.size() * sizeof(shared::BvhNode)),
              0);
    EXPECT_EQ(before->order, after->order);
    EXPECT_EQ(before->bounds.min, after->bounds.min);
    EXPECT_EQ(before->cost, after->cost);
    EXPECT_EQ(before->depth, after->depth);
    ++read->editMesh(MeshId{0}).pointsRevision;
    EXPECT_FALSE(builtBvh(read->meshes()[0])) << "of other points";
}

TEST_F(Snapshot, EqualScenesGiveEqualBytes) {
    const auto scene = everything();
    const std::vector<std::byte> first = written(*scene);
    EXPECT_EQ(first, written(*everything()));
    const auto read = readSnapshot(path());
    EXPECT_EQ(first, written(*read)) << "cooked twice";
}

TEST_F(Snapshot, EmptyScene) {
    Scene scene;
    EXPECT_EQ(roundTrip(scene)->world.size(), 0u);
}

// ---- time ---------------------------------------------------------------------------------------

/// Everything that may vary, in ways that are neither linear nor held.
std::unique_ptr<Scene> moving() {
    auto scene = everything();
    const MeshId soft = scene->addMesh(square(0)), growing = scene->addMesh(square(1));
    scene->editMesh(soft).deforming = true;
    for (const auto& [path, mesh] : {std::pair{"/soft", soft}, {"/growing", growing}})
        scene->world.add(scene->createEntity(path), MeshInstance{mesh, {MaterialId{0}}});
    scene->createEntity("/bud");
    auto guest = std::make_shared<Entity>();
    Scene* s = scene.get();
    const auto play = [s, guest, soft, growing](double t) {
        const auto edit = [&](auto* component, std::string_view path, auto&& change) {
            using C = std::remove_pointer_t<decltype(component)>;
            s->world.each<Name>([&](Entity entity, const Name& name) {
                if (name.path == path) change(*s->world.modify<C>(entity));
            });
        };
        edit((LocalTransform*)nullptr, "/a", [&](LocalTransform& transform) {
            transform.parentFromLocal =
                glm::scale(glm::rotate(glm::translate(glm::dmat4(1), {t, 0, 0}), 2 * t, {0, 0.6, 0.8}), {1, 2, -3});
        });
        edit((LocalTransform*)nullptr, "/ball", [&](LocalTransform& transform) {
            const glm::dmat4 turned = glm::rotate(glm::dmat4(1), 0.3 * t, {1, 0, 0});
            transform.parentFromLocal = turned * glm::rotate(glm::dmat4(1), 1.7 * t * t, {0, 1, 0});
        });
        edit((LocalTransform*)nullptr, "/bud", [&](LocalTransform& transform) {
            transform.parentFromLocal = glm::scale(glm::rotate(glm::dmat4(1), t, {0, 1, 0}), glm::dvec3(t - 1));
        });
        edit((Visibility*)nullptr, "/a", [&](Visibility& v) { v.visible = t >= 2 && t < 3; });
        edit((SphereInstance*)nullptr, "/ball", [&](SphereInstance& sphere) { sphere.radius = float(1 + t); });
        edit((Light*)nullptr, "/sky", [&](Light& light) { light.radiance = glm::vec3(std::exp2(3 * t)); });
        edit((Camera*)nullptr, "/cam", [&](Camera& camera) { camera.focalLength = float(20 + t); });
        Material& paint = s->editMaterial(MaterialId{0});
        paint.roughness = float(0.1 * t);
        // The slot of the checker shows another picture for a while.
        if (const bool other = t >= 3; other != (s->texture(TextureId{0}).name == "other.png")) {
            Texture& texture = s->editTexture(TextureId{0});
            const uint64_t revision = texture.revision;
            texture = checker();
            texture.revision = revision;
            if (other) {
                texture.name = "other.png";
                texture.rgba8[0] = 7;
            }
        }
        Mesh& mesh = s->editMesh(soft);
        mesh.positions[0].z = float(t);
        ++mesh.pointsRevision;
        Mesh& other = s->editMesh(growing);
        const size_t triangles = t >= 2 ? 1 : 2;
        if (other.triangles.size() != triangles) {
            other = square(1);
            other.triangles.resize(triangles);
            other.normals.resize(3 * triangles);
            other.uvs.resize(3 * triangles);
            other.triangleSubset.resize(triangles);
            other.topologyRevision = ++mesh.topologyRevision + 10;
            other.pointsRevision = mesh.pointsRevision + 10;
            --mesh.topologyRevision;
        }
        if (const bool there = t >= 2 && t < 4; there != bool(*guest)) {
            if (there) {
                *guest = s->createEntity("/guest");
                s->world.add(*guest, SphereInstance{.radius = 0.5f});
            } else {
                s->world.destroy(std::exchange(*guest, {}));
            }
        }
    };
    scene->setTime(1);
    play(1);
    buildMeshBvhs(*scene);
    scene->source = std::make_unique<Script>(std::vector<double>{1, 1.5, 2, 3, 4}, play);
    return scene;
}

TEST_F(Snapshot, SamplesAndFramesAreExact) {
    const auto scene = moving();
    const auto read = roundTrip(*scene);
    EXPECT_NE(read->source, nullptr);
    for (const double time : {1.0, 1.5, 2.0, 3.0, 4.0, 2.0, 1.0}) {
        SCOPED_TRACE(time);
        scene->setTime(time);
        read->setTime(time);
        // The texture's slot differs, not what it shows.
        Material mine = scene->material(MaterialId{0}), theirs = read->material(MaterialId{0});
        EXPECT_TRUE(
            snapshot::same(scene->texture(mine.baseColorMap.texture), read->texture(theirs.baseColorMap.texture)));
        scene->editMaterial(MaterialId{0}).baseColorMap.texture = theirs.baseColorMap.texture;
        expectSame(*scene, *read);
        scene->editMaterial(MaterialId{0}).baseColorMap.texture = mine.baseColorMap.texture;
    }
    EXPECT_EQ(read->textures().size(), 3u);
}

/// Greatest difference of a number, relative to 1 or the field's greatest number if that is more.
struct RelativeError {
    double worst = 0;
    template<class T>
    void operator()(const T& a, const T& b) {
        if constexpr (snapshot::Record<T>) {
            snapshot::fields(*this, a, b);
        } else if constexpr (snapshot::Numeric<T>) {
            const auto x = snapshot::numbers(a), y = snapshot::numbers(b);
            double size = 1;
            for (const double v : x) size = std::max(size, std::abs(v));
            for (size_t i = 0; i < x.size(); ++i)
                if (x[i] != y[i]) worst = std::max(std::abs(double(x[i]) - double(y[i])) / size, worst); // NaN counts
        }
    }
};

/// Off by about a thousandth of the change over the span between two samples: the ball turns by up to 12 radians along
/// one, the sky becomes 8 times as bright.
TEST_F(Snapshot, BetweenSamplesValuesAreClose) {
    const auto scene = moving();
    const auto read = roundTrip(*scene);
    for (double time = 1; time <= 4; time += 1.0 / 37) {
        SCOPED_TRACE(time);
        scene->setTime(time);
        read->setTime(time);
        const auto error = [&](auto* type, const char* path) {
            using C = std::remove_pointer_t<decltype(type)>;
            RelativeError compare;
            compare(get<C>(*scene, path), get<C>(*read, path));
            return compare.worst;
        };
        EXPECT_LT(error((LocalTransform*)nullptr, "/a"), 1e-12) << "a rigid motion";
        EXPECT_LT(error((LocalTransform*)nullptr, "/ball"), 4e-3);
        EXPECT_LT(error((LocalTransform*)nullptr, "/bud"), 4e-3) << "out of nothing, which has no rotation";
        EXPECT_LT(error((Light*)nullptr, "/sky"), 8e-3);
        EXPECT_LT(error((Camera*)nullptr, "/cam"), 1e-6) << "linear";
        EXPECT_LT(error((SphereInstance*)nullptr, "/ball"), 1e-6) << "linear";
        EXPECT_EQ(get<Visibility>(*read, "/a").visible, get<Visibility>(*scene, "/a").visible);
        EXPECT_NEAR(read->meshes()[1].positions[0].z, time, 1e-6);
        EXPECT_EQ(read->meshes()[2].triangles.size(), scene->meshes()[2].triangles.size());
    }
}

TEST_F(Snapshot, OnlyWhatDiffersChanges) {
    const auto scene = moving();
    const auto read = roundTrip(*scene);
    read->setTime(2);
    const Tick before = read->world.now();
    const uint64_t points = read->meshes()[1].pointsRevision, material = read->materials()[0].revision;
    read->setTime(2);
    EXPECT_EQ(read->world.now(), before);
    EXPECT_EQ(read->meshes()[1].pointsRevision, points);
    EXPECT_EQ(read->materials()[0].revision, material);
    const uint64_t topology = read->meshes()[1].topologyRevision;
    read->setTime(3);
    EXPECT_EQ(read->meshes()[1].pointsRevision, points + 1);
    EXPECT_EQ(read->meshes()[1].topologyRevision, topology);
}

TEST_F(Snapshot, FramesNarrowTheRange) {
    const auto scene = moving();
    const double frames[] = {2, 3};
    scene->setTime(2);
    const auto read = roundTrip(*scene, frames);
    EXPECT_EQ(read->startTime, 2);
    EXPECT_EQ(read->endTime, 3);
    read->setTime(1);
    EXPECT_EQ(get<Camera>(*read, "/cam").focalLength, 22) << "the first key holds before it";
    read->setTime(4);
    EXPECT_EQ(get<Camera>(*read, "/cam").focalLength, 23);
}

TEST_F(Snapshot, MaterialsMayAppearLater) {
    const auto scene = everything();
    scene->source = std::make_unique<Script>(std::vector<double>{1, 2}, [s = scene.get()](double time) {
        if (time < 2 || s->materials().size() > 1) return;
        Material late = s->materials()[0];
        late.name = "/late";
        late.roughness = 0.75f;
        const MaterialId id = s->addMaterial(late);
        s->world.each<SphereInstance>(
            [&](Entity entity, const SphereInstance&) { s->world.modify<SphereInstance>(entity)->material = id; });
    });
    const auto read = roundTrip(*scene);
    read->setTime(2);
    expectSame(*scene, *read);
    EXPECT_EQ(get<SphereInstance>(*read, "/ball").material, MaterialId{1});
}

TEST_F(Snapshot, TooManyFrames) {
    const auto scene = everything();
    scene->source = std::make_unique<Script>(std::vector<double>{0, 1e9}, [](double) {});
    EXPECT_THROW(writeSnapshot(*scene, path()), Error);
}

// ---- files that are not what they should be ------------------------------------------------------

std::vector<std::byte> resealed(std::vector<std::byte> bytes) {
    const uint64_t sum = snapshot::checksum(std::span(bytes).subspan(snapshot::kUnchecked));
    std::memcpy(bytes.data() + offsetof(snapshot::Header, checksum), &sum, sizeof(sum));
    return bytes;
}

template<class T>
void put(std::vector<std::byte>& bytes, size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(value));
}

TEST_F(Snapshot, WrongMagicVersionAndByteOrder) {
    const std::vector<std::byte> good = written(*everything());
    const auto with = [&](size_t offset, uint32_t value) {
        std::vector<std::byte> bytes = good;
        put(bytes, offset, value);
        return errorOf(bytes);
    };
    EXPECT_EQ(errorOf(good), "");
    EXPECT_NE(with(0, 0x12345678).find("not a .tlscene file"), std::string::npos);
    EXPECT_NE(with(offsetof(snapshot::Header, version), 0).find("format 0"), std::string::npos);
    EXPECT_NE(with(offsetof(snapshot::Header, version), 99).find("format 99"), std::string::npos);
    EXPECT_NE(with(offsetof(snapshot::Header, byteOrder), 0x04030201).find("byte order"), std::string::npos);
    EXPECT_NE(errorOf({}), "");
    try {
        readSnapshot(fs::temp_directory_path());
        ADD_FAILURE() << "a folder is read";
    } catch (const Error& e) {
        EXPECT_EQ(e.problem() + ": " + e.hint(), "not a file: name a file in place of this folder, pipe or device");
    }
    EXPECT_THROW(readSnapshot("/nowhere/at.all"), Error);
}

TEST_F(Snapshot, AnyBitMatters) {
    const std::vector<std::byte> good = written(*everything());
    std::mt19937 random(1);
    for (size_t i = 0; i < good.size(); ++i) {
        std::vector<std::byte> bytes = good;
        bytes[i] ^= std::byte(1 << random() % 8);
        ASSERT_NE(errorOf(bytes), "") << i;
    }
}

TEST_F(Snapshot, AnyLengthMatters) {
    std::vector<std::byte> bytes = written(*moving());
    std::vector<std::byte> longer = bytes;
    longer.resize(bytes.size() + 64);
    EXPECT_NE(errorOf(longer), "");
    std::mt19937 random(2);
    while (!bytes.empty()) {
        bytes.resize(bytes.size() - std::min<size_t>(bytes.size(), 1 + random() % 97));
        ASSERT_NE(errorOf(bytes), "") << bytes.size();
    }
}

/// Forged so that the checksum fits: numbers become others, most of them extreme. What is read without an error is a
/// scene that can be played.
TEST_F(Snapshot, NothingIsBelieved) {
    const std::vector<std::byte> good = written(*moving());
    std::mt19937_64 random(3);
    const uint64_t extremes[] = {0, 1, 2, 0x7f, 0xff, 0xffff, 0x7fffffff, 0x80000000, ~0ull, ~0ull >> 1, 1ull << 40};
    size_t declined = 0;
    for (int i = 0; i < 1000; ++i) {
        std::vector<std::byte> bytes = good;
        for (uint64_t n = 1 + random() % 3; n > 0; --n) {
            const size_t at = snapshot::kUnchecked + random() % (bytes.size() - snapshot::kUnchecked - 8);
            const uint64_t value = random() % 4 == 0 ? random() : extremes[random() % std::size(extremes)];
            if (random() % 2 == 0)
                put(bytes, at & ~size_t{7}, value);
            else
                put(bytes, at & ~size_t{3}, static_cast<uint32_t>(value));
        }
        declined += errorOf(resealed(std::move(bytes))).empty() ? 0 : 1;
    }
    EXPECT_GT(declined, 100u);
    EXPECT_LT(declined, 1000u);
}

TEST_F(Snapshot, DamagedMeshesOfATrackAreDeclinedEachTime) {
    const auto scene = everything();
    scene->source = std::make_unique<Script>(std::vector<double>{1, 2}, [s = scene.get()](double time) {
        Mesh& mesh = s->editMesh(MeshId{0});
        mesh.triangles[0].x = time < 2 ? 0 : 4;
        ++mesh.topologyRevision;
    });
    const auto read = roundTrip(*scene);
    for (int i = 0; i < 2; ++i) {
        EXPECT_THROW(read->setTime(2), Error);
        EXPECT_THROW(read->setTime(2), Error) << "nothing changed since";
        EXPECT_NO_THROW(read->setTime(1));
    }
}

/// Numbers that are no value of an enumeration, whatever its type.
TEST_F(Snapshot, EnumerationsAreChecked) {
    const auto scene = everything();
    for (const int value : {4, -1, 1 << 20}) {
        scene->editTexture(TextureId{0}).wrapS = static_cast<Wrap>(value);
        EXPECT_NE(errorOf(written(*scene)), "") << value;
    }
    scene->editTexture(TextureId{0}).wrapS = Wrap::Black;
    EXPECT_EQ(errorOf(written(*scene)), "");
    scene->editMaterial(MaterialId{0}).roughnessMap.texture = TextureId{2};
    EXPECT_NE(errorOf(written(*scene)), "") << "a texture that is not there";
}

/// A BVH that runs in circles, is shared, or leads outside would hang or crash the tracer.
TEST_F(Snapshot, BvhIsChecked) {
    const auto scene = everything();
    const std::shared_ptr<const MeshBvh> good = scene->meshes()[0].bvh;
    const auto declines = [&](auto&& change) {
        MeshBvh bvh = *good;
        bvh.nodes.resize(3, bvh.nodes[0]);
        bvh.nodes[0].children[0] = 1;
        bvh.nodes[0].children[1] = 2;
        change(bvh);
        scene->editMesh(MeshId{0}).bvh = std::make_shared<const MeshBvh>(bvh);
        return errorOf(written(*scene)).find("BVH") != std::string::npos;
    };
    EXPECT_FALSE(declines([](MeshBvh&) {}));
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes[1].children[0] = 0; })) << "a circle";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes[1].children[0] = 2; })) << "two parents";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes[0].children[1] = shared::kBvhEmpty; })) << "no parent";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes[1].children[0] = 3; })) << "outside";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes[1].children[0] = shared::kBvhEmpty | 15u << 27; })) << "a leaf";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.order[0] = 2; })) << "a triangle";
    EXPECT_TRUE(declines([](MeshBvh& bvh) { bvh.nodes.clear(); })) << "nothing";
    EXPECT_TRUE(declines([](MeshBvh& bvh) {
        const shared::BvhNode node = bvh.nodes[1];
        bvh.nodes.assign(shared::kBvhMeshDepth + 1, node);
        for (uint32_t i = 0; i < shared::kBvhMeshDepth; ++i) bvh.nodes[i].children[0] = i + 1;
    })) << "deeper than the stack";
}

} // namespace
} // namespace trilume
