// ReSTIR DI against ray tracing: in unbiased mode the expected picture is the same, whatever moves, comes or goes from
// frame to frame, after any number of frames.
#include "renderer_fixture.h"
#include "statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace trilume {
namespace {

constexpr uint32_t kSize = 24, kBlock = 8;
constexpr int kReferences = 8;
/// Of any test failing by chance: pictures come out the same in every run, so a pass stays a pass.
constexpr double kSignificance = 1e-3;

using test::addCamera;
using test::engine;
using test::lambert;
using test::quad;

glm::dmat4 at(glm::dvec3 position) { return glm::translate(glm::dmat4(1), position); }
glm::dmat4 lookingDown(glm::dvec3 position) {
    return glm::rotate(at(position), -glm::radians(90.0), glm::dvec3(1, 0, 0));
}

/// A floor, a wall and a ball under lights of every kind.
struct Room {
    static constexpr glm::dvec3 kTarget{0, 0.9, 0};

    Room() {
        const MaterialId grey = scene.addMaterial(lambert(glm::vec3(0.6f, 0.5f, 0.4f)));
        glossy.baseColor = glm::vec3(0.3f);
        glossy.roughness = 0.3f;
        const MaterialId shiny = scene.addMaterial(glossy);
        scene.world.add(
            scene.createEntity("/Floor"),
            MeshInstance{scene.addMesh(quad("/Floor", {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4})), {grey}});
        scene.world.add(
            scene.createEntity("/Wall"),
            MeshInstance{scene.addMesh(quad("/Wall", {-4, 0, -2}, {4, 0, -2}, {4, 5, -2}, {-4, 5, -2})), {grey}});
        Mesh curtain = quad("/Curtain", {-1.6f, 0, 0}, {-0.8f, 0, 0}, {-0.8f, 2, 0}, {-1.6f, 2, 0});
        curtain.deforming = true;
        curtainMesh = scene.addMesh(curtain);
        scene.world.add(scene.createEntity("/Curtain"), MeshInstance{curtainMesh, {grey}});
        ball = scene.createEntity("/Ball", at({0.3, 0.6, 0}));
        scene.world.add(ball, SphereInstance{0.6f, shiny});

        Light light;
        light.kind = LightKind::Rect;
        light.width = light.height = 1.5f;
        light.radiance = glm::vec3(3, 2.5f, 2);
        rect = addLight("/Rect", light, lookingDown({-1, 3.5, 0.5}));
        light.kind = LightKind::Sphere;
        light.radius = 0.25f;
        light.radiance = glm::vec3(6, 2, 2);
        sphere = addLight("/Sphere", light, at({1.6, 1.2, 0.6}));
        light.kind = LightKind::Disk;
        light.radiance = glm::vec3(2, 6, 2);
        addLight("/Disk", light, lookingDown({2, 2.5, -1}));
        light.kind = LightKind::Cylinder;
        light.radius = 0.06f;
        light.length = 1.5f;
        light.radiance = glm::vec3(2, 2, 8);
        addLight("/Tube", light, at({-2, 1, -1.6}));
        light.kind = LightKind::Distant;
        light.angle = 0;
        light.radiance = glm::vec3(0.3f);
        sun = addLight("/Sun", light, glm::rotate(at({}), glm::radians(-50.0), glm::normalize(glm::dvec3(1, 0.4, 0))));
        glow = scene.createEntity("/Glow", at({0, 1.8, -1.9}));
        scene.world.add(glow, MeshInstance{scene.addMesh(quad("/Glow", {-0.5f, 0, 0}, {0.5f, 0, 0}, {0.5f, 0.3f, 0},
                                                              {-0.5f, 0.3f, 0})),
                                           {scene.addMaterial(lambert(glm::vec3(0), glm::vec3(4, 4, 1)))}});
        camera = addCamera(scene, {0.5, 2, 6}, kTarget);
    }
    Entity addLight(const char* name, const Light& light, const glm::dmat4& place) {
        const Entity entity = scene.createEntity(name, place);
        scene.world.add(entity, light);
        return entity;
    }
    static glm::dmat4 cameraAt(glm::dvec3 position) { return test::cameraAt(position, kTarget); }
    void place(Entity entity, const glm::dmat4& m) { scene.world.modify<LocalTransform>(entity)->parentFromLocal = m; }
    void show(Entity entity, bool visible) {
        if (!scene.world.find<Visibility>(entity)) scene.world.add(entity, Visibility{});
        scene.world.modify<Visibility>(entity)->visible = visible;
    }

    Scene scene;
    Material glossy;
    MeshId curtainMesh;
    Entity ball, rect, sphere, sun, glow, camera;
};

/// Means over blocks of pixels and channels of the direct light.
std::vector<double> directBlocks(View& view, uint32_t spp) {
    view.render({.spp = spp});
    const ImageData image = view.aov("direct");
    const uint32_t blocks = kSize / kBlock;
    std::vector<double> means(size_t{blocks} * blocks);
    for (uint32_t y = 0; y < kSize; ++y)
        for (uint32_t x = 0; x < kSize; ++x)
            for (uint32_t c = 0; c < 3; ++c)
                means[y / kBlock * blocks + x / kBlock] +=
                    image.pixels[(size_t{y} * kSize + x) * 3 + c] / (3.0 * kBlock * kBlock);
    return means;
}

struct Mean {
    std::vector<double> sum, squares;
    int count = 0;
    void add(const std::vector<double>& values) {
        sum.resize(values.size());
        squares.resize(values.size());
        for (size_t i = 0; i < values.size(); ++i) sum[i] += values[i], squares[i] += values[i] * values[i];
        ++count;
    }
    double mean(size_t i) const { return sum[i] / count; }
    double variance(size_t i) const { return (squares[i] / count - mean(i) * mean(i)) / (count - 1); }
};

class RestirDiTest : public testing::Test {
protected:
    using Step = std::function<void(Room&, int frame)>;

    void TearDown() override { EXPECT_EQ(engine().device().validationMessages(), 0u); }

    /// The last of `frames` frames, of which `step` sets the scene, over many seeds, against ray tracing of that frame.
    void expectUnbiased(const Step& step, int frames, int seeds = 128) {
        Room room;
        step(room, frames - 1);
        Mean expected, found;
        {
            View view(engine(), room.scene, kSize, kSize, "");
            view.setTechnique("raytrace");
            view.setAovs({"direct"});
            for (int seed = 0; seed < kReferences; ++seed) {
                view.setSeed(1000 + seed);
                expected.add(directBlocks(view, 128));
            }
        }
        View view(engine(), room.scene, kSize, kSize, "");
        view.setTechnique("restir");
        view.setAovs({"direct"});
        for (const auto& [name, value] : settings_) view.params().set(name, value);
        for (int seed = 0; seed < seeds; ++seed) {
            step(room, 0);
            view.setSeed(seed);
            view.prepare(); // forgets the seed before
            for (int frame = 0; frame + 1 < frames; ++frame) {
                step(room, frame);
                view.render({.spp = 1});
                EXPECT_EQ(view.stats().nonfinite, 0u);
            }
            step(room, frames - 1);
            found.add(directBlocks(view, 1));
        }
        double total = 0, totalExpected = 0;
        for (size_t i = 0; i < found.sum.size(); ++i) {
            const double error = std::sqrt(found.variance(i) + expected.variance(i));
            const double z = (found.mean(i) - expected.mean(i)) / error;
            EXPECT_GT(test::normalTail(z), test::sidak(kSignificance, double(found.sum.size())))
                << "block " << i << ": " << found.mean(i) << " for " << expected.mean(i) << " +- " << error;
            total += found.mean(i), totalExpected += expected.mean(i);
        }
        EXPECT_GT(totalExpected, 0);
        RecordProperty("ratio", std::to_string(total / totalExpected));
        std::printf("  ratio of means %.5f\n", total / totalExpected);
    }

    std::vector<std::pair<const char*, const char*>> settings_{{"restir_di.reuse", "spatiotemporal"}};
};

void still(Room&, int) {}

TEST_F(RestirDiTest, StillScene) { expectUnbiased(still, 4); }

TEST_F(RestirDiTest, FirstFrame) { expectUnbiased(still, 1); }

TEST_F(RestirDiTest, WithoutReuse) {
    settings_ = {{"restir_di.reuse", "off"}};
    expectUnbiased(still, 1);
}

TEST_F(RestirDiTest, LearnedLightsThatComeAndGo) {
    settings_ = {{"restir_di.reuse", "off"}};
    expectUnbiased(
        [](Room& room, int frame) {
            room.show(room.sphere, frame != 2);
            room.place(room.ball, at({0.3 + 0.3 * frame, 0.6, 0.2 * frame}));
        },
        4);
}

TEST_F(RestirDiTest, BsdfSamplesOnEverySurface) {
    settings_.push_back({"restir_di.bsdfRoughness", "1"});
    expectUnbiased(still, 3);
}

TEST_F(RestirDiTest, MovingLight) {
    expectUnbiased([](Room& room, int frame) { room.place(room.sphere, at({1.6 - 0.4 * frame, 1.2, 0.6})); }, 4);
}

TEST_F(RestirDiTest, TeleportedAndScaledLight) {
    expectUnbiased(
        [](Room& room, int frame) {
            room.place(room.sphere,
                       frame < 2 ? at({1.6, 1.2, 0.6}) : glm::scale(at({-1.6, 1.5, 1.5}), glm::dvec3(2, 0.5, 1.2)));
        },
        3);
}

TEST_F(RestirDiTest, MovingObject) {
    expectUnbiased([](Room& room, int frame) { room.place(room.ball, at({0.3 + 0.3 * frame, 0.6, 0.2 * frame})); }, 4);
}

TEST_F(RestirDiTest, DeformingMesh) {
    expectUnbiased(
        [](Room& room, int frame) {
            Mesh& mesh = room.scene.editMesh(room.curtainMesh);
            mesh.positions[2].x = mesh.positions[1].x = -0.8f + 0.5f * float(frame);
            ++mesh.pointsRevision;
        },
        4);
}

TEST_F(RestirDiTest, LightsComeAndGo) {
    expectUnbiased(
        [](Room& room, int frame) {
            room.show(room.rect, frame != 2);
            room.show(room.sun, frame > 0);
            room.show(room.sphere, frame == 2);
        },
        3);
}

TEST_F(RestirDiTest, CameraCut) {
    expectUnbiased(
        [](Room& room, int frame) {
            room.place(room.camera, Room::cameraAt(frame < 2 ? glm::dvec3(0.5, 2, 6) : glm::dvec3(3, 1, 3)));
        },
        3);
}

TEST_F(RestirDiTest, MovingCamera) {
    expectUnbiased(
        [](Room& room, int frame) {
            room.place(room.camera, Room::cameraAt({0.5 + 0.2 * frame, 2, 6}));
        },
        4);
}

// Another light, whose light meets nothing, keeps the node and its reuse going.
TEST_F(RestirDiTest, NothingIsLeftOfARemovedLight) {
    Room room;
    std::vector<Entity> lights;
    room.scene.world.each<Light>([&](Entity entity, const Light&) { lights.push_back(entity); });
    for (const Entity entity : lights) room.show(entity, entity == room.sphere);
    room.scene.world.modify<MeshInstance>(room.glow)->materials = {};
    Light below;
    room.addLight("/Below", below, lookingDown({0, -1, 0}));

    View view(engine(), room.scene, kSize, kSize, "");
    view.setTechnique("restir");
    view.params().set("restir_di.reuse", "spatiotemporal");
    for (int frame = 0; frame < 3; ++frame) view.render({.spp = 1});
    view.setAovs({"direct"});
    const auto brightest = [&] {
        view.render({.spp = 1});
        const ImageData direct = view.aov("direct");
        return *std::max_element(direct.pixels.begin(), direct.pixels.end());
    };
    EXPECT_GT(brightest(), 0.1f);
    room.show(room.sphere, false);
    EXPECT_EQ(brightest(), 0.0f);
    // Long enough for what tiles know of light to fade away.
    view.render({.spp = 1, .warmup = 700});
    room.show(room.sphere, true);
    EXPECT_GT(brightest(), 0.1f);
    EXPECT_EQ(view.stats().nonfinite, 0u);
    room.scene.world.modify<Light>(room.sphere)->radiance = glm::vec3(0);
    EXPECT_EQ(brightest(), 0.0f);
}

} // namespace
} // namespace trilume
