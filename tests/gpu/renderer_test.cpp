// The engine as an application uses it, on scenes made in memory.
#include "renderer_fixture.h"

#include "core/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <utility>

namespace trilume {
namespace {

using test::addCamera;
using test::engine;
using test::lambert;
using test::quad;

Mesh boxMesh(float halfSize) {
    Mesh mesh;
    mesh.name = "/Box";
    for (int i = 0; i < 8; ++i)
        mesh.positions.emplace_back((i & 1 ? 1 : -1) * halfSize, (i & 2 ? 1 : -1) * halfSize,
                                    (i & 4 ? 1 : -1) * halfSize);
    // Counter-clockwise from inside: the front faces look into the box.
    const glm::uvec4 faces[6] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    for (const auto& f : faces) {
        mesh.triangles.emplace_back(f.x, f.y, f.z);
        mesh.triangles.emplace_back(f.x, f.z, f.w);
    }
    return mesh;
}

/// A closed box that emits `emission` and reflects `albedo`, seen from inside.
void fillFurnace(Scene& scene, float albedo, float emission, double scale = 1, glm::dvec3 at = glm::dvec3(0)) {
    const MaterialId material = scene.addMaterial(lambert(glm::vec3(albedo), glm::vec3(emission)));
    const Entity box = scene.createEntity("/Box", glm::scale(glm::translate(glm::dmat4(1), at), glm::dvec3(scale)));
    scene.world.add(box, MeshInstance{scene.addMesh(boxMesh(1)), {material}});
    addCamera(scene, at + scale * glm::dvec3(0.3, 0.2, 0.5), at + scale * glm::dvec3(-1, -0.4, -0.7));
}

/// A lamp above a floor, and a ball.
struct Room {
    Room() {
        const MaterialId grey = scene.addMaterial(lambert(glm::vec3(0.5f)));
        const Mesh floor = quad("/Floor", {-5, 0, -5}, {-5, 0, 5}, {5, 0, 5}, {5, 0, -5});
        scene.world.add(scene.createEntity("/Floor"), MeshInstance{scene.addMesh(floor), {grey}});
        ball = scene.createEntity("/Ball", glm::translate(glm::dmat4(1), {0, 1, 0}));
        scene.world.add(ball, SphereInstance{0.5f, grey});
        lamp = scene.createEntity(
            "/Lamp", glm::rotate(glm::translate(glm::dmat4(1), {0, 4, 0}), -glm::radians(90.0), glm::dvec3(1, 0, 0)));
        Light light;
        light.radiance = glm::vec3(10);
        scene.world.add(lamp, light);
        camera = addCamera(scene, {0, 2, 6}, {0, 1, 0});
    }
    Scene scene;
    Entity ball, lamp, camera;
};

double mean(const ImageData& image) {
    double sum = 0;
    for (size_t i = 0; i < image.pixels.size(); i += image.channels)
        for (int c = 0; c < 3; ++c) sum += image.pixels[i + c];
    return sum / (3.0 * image.width * image.height);
}

void expectSame(const ImageData& a, const ImageData& b) {
    ASSERT_EQ(a.pixels.size(), b.pixels.size());
    EXPECT_EQ(std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)), 0);
}

class RendererTest : public testing::Test {
protected:
    void TearDown() override { EXPECT_EQ(engine().device().validationMessages(), 0u); }
};

// Every surface emits and reflects: L = Le + rho L everywhere (Veach 1997's furnace).
TEST_F(RendererTest, ClosedFurnaceGivesTheGeometricSeries) {
    Scene scene;
    fillFurnace(scene, 0.8f, 0.25f);
    View view(engine(), scene, 32, 32, "");
    view.setTechnique("pathtrace");
    const ImageData image = view.render({.spp = 512});
    EXPECT_NEAR(mean(image), 0.25 / (1 - 0.8), 0.005 * 1.25);
    EXPECT_EQ(view.stats().nonfinite, 0u);
    EXPECT_GT(view.stats().rays, 32u * 32u * 512u * 5u);
}

TEST_F(RendererTest, PathClassesOfTheFurnaceAreItsTerms) {
    Scene scene;
    fillFurnace(scene, 0.8f, 0.25f);
    View view(engine(), scene, 32, 32, "");
    view.setTechnique("pathtrace");
    view.setAovs({"emission", "direct", "indirect", "caustic", "variance"});
    const ImageData image = view.render({.spp = 512});
    EXPECT_NEAR(mean(view.aov("emission")), 0.25, 1e-5);
    EXPECT_NEAR(mean(view.aov("direct")), 0.8 * 0.25, 0.005 * 0.2);
    EXPECT_NEAR(mean(view.aov("indirect")), 0.25 * 0.64 / 0.2, 0.008 * 0.8);
    EXPECT_EQ(mean(view.aov("caustic")), 0.0);
    EXPECT_NEAR(mean(view.aov("emission")) + mean(view.aov("direct")) + mean(view.aov("indirect")), mean(image), 1e-5);
    // The variance AOV predicts how far the mean over the picture is off.
    double variance = 0;
    for (const float v : view.aov("variance").pixels) variance += v;
    EXPECT_LT(std::abs(mean(image) - 1.25), 5 * std::sqrt(variance) / (32 * 32));
}

TEST_F(RendererTest, ConvexObjectInAConstantDomeShowsItsAlbedo) {
    Scene scene;
    const MaterialId material = scene.addMaterial(lambert(glm::vec3(0.8f)));
    scene.world.add(scene.createEntity("/Ball"), SphereInstance{1, material});
    Light dome;
    dome.kind = LightKind::Dome;
    scene.world.add(scene.createEntity("/Dome"), dome);
    addCamera(scene, {0, 0, 1.2}, {0, 0, 0}); // sees nothing but the ball
    View view(engine(), scene, 32, 32, "");
    view.setTechnique("pathtrace");
    EXPECT_NEAR(mean(view.render({.spp = 256})), 0.8, 0.002 * 0.8);
}

TEST_F(RendererTest, TheSameSeedGivesTheSameBits) {
    Room room;
    const auto shoot = [&](uint64_t seed) {
        View view(engine(), room.scene, 48, 32, "");
        view.setTechnique("pathtrace");
        view.setSeed(seed);
        return view.render({.spp = 4});
    };
    const ImageData first = shoot(1);
    expectSame(first, shoot(1));
    EXPECT_NE(first.pixels, shoot(2).pixels);
}

TEST_F(RendererTest, NothingIsBuiltForWhatDidNotChange) {
    Room room;
    View view(engine(), room.scene, 32, 32, "");
    view.setTechnique("pathtrace");
    view.render({.spp = 1});
    EXPECT_EQ(view.stats().blasBuilt, 1u);
    EXPECT_EQ(view.stats().tlasBuilt, 1u);
    view.render({.spp = 1});
    EXPECT_EQ(view.stats().blasBuilt + view.stats().tlasBuilt, 0u);
    EXPECT_EQ(view.stats().uploadedBytes, 0u);

    room.scene.world.modify<LocalTransform>(room.ball)->parentFromLocal[3].x = 1;
    view.render({.spp = 1});
    EXPECT_EQ(view.stats().blasBuilt, 0u);
    EXPECT_EQ(view.stats().tlasBuilt, 1u);
    EXPECT_GT(view.stats().uploadedBytes, 0u);
}

TEST_F(RendererTest, AStillPictureIsAveragedAndThenRests) {
    Room room;
    View view(engine(), room.scene, 32, 32, ""), whole(engine(), room.scene, 32, 32, "");
    const auto look = [&] { return view.render({.spp = 3, .restAfter = 8}); };
    const auto state = [&] { return view.stats().nodes.front().state; };
    view.setTechnique("pathtrace");
    whole.setTechnique("pathtrace");
    look();
    EXPECT_EQ(view.stats().spp, 3u);
    look(); // begins anew: that the scene is new was news to the first
    while (view.stats().spp < 8) look();
    EXPECT_EQ(state(), "run");
    const ImageData finished = look();
    EXPECT_EQ(state(), "idle");
    EXPECT_EQ(view.stats().nodes.front().reason, "nothing changed");
    EXPECT_EQ(view.stats().rays, 0u);
    EXPECT_EQ(view.stats().spp, 8u);
    expectSame(finished, look());
    whole.render({.spp = 3});
    expectSame(finished, whole.render({.spp = 8}));
    whole.setSeed(3);
    expectSame(finished, whole.aov("color"));

    const auto wakes = [&](const char* what) {
        look();
        EXPECT_EQ(state(), "run") << what;
        EXPECT_EQ(view.stats().spp, 3u) << what;
        for (int i = 0; i < 5; ++i) look();
        EXPECT_EQ(state(), "idle") << what;
    };
    room.scene.world.modify<LocalTransform>(room.ball)->parentFromLocal[3].x = 1;
    wakes("a thing moved");
    room.scene.world.modify<LocalTransform>(room.camera)->parentFromLocal[3].x = 0.1;
    wakes("the camera moved");
    view.params().set("pathtrace.maxDepth", "3");
    wakes("a parameter");
    view.setSeed(4);
    wakes("the seed");
    view.render({.spp = 2}); // an average of its own, as ever
    EXPECT_EQ(view.stats().spp, 2u);
}

TEST_F(RendererTest, AMovedObjectLooksAsIfItHadAlwaysBeenThere) {
    Room moved, there;
    const glm::dmat4 place = glm::translate(glm::dmat4(1), {1.5, 1, 0.5});
    there.scene.world.modify<LocalTransform>(there.ball)->parentFromLocal = place;
    View movedView(engine(), moved.scene, 48, 32, ""), thereView(engine(), there.scene, 48, 32, "");
    movedView.setTechnique("pathtrace");
    thereView.setTechnique("pathtrace");
    movedView.render({.spp = 1});
    moved.scene.world.modify<LocalTransform>(moved.ball)->parentFromLocal = place;
    thereView.render({.spp = 1});
    expectSame(movedView.render({.spp = 4}), thereView.render({.spp = 4}));
}

// Each step takes one of the ways by which changes reach the device: moves alone, moves that change what can be hit,
// lights that move, things that come and go.
TEST_F(RendererTest, AfterEachOfManyChangesTheSceneIsWhatAFreshOneWouldBe) {
    struct Crowd : Room {
        Crowd() {
            const MaterialId red = scene.addMaterial(lambert({0.8f, 0.2f, 0.1f}));
            const MaterialId glow = scene.addMaterial(lambert(glm::vec3(0.5f), {0, 0.5f, 2}));
            group = scene.createEntity("/Group", glm::dmat4(1), {});
            for (int i = 0; i < 40; ++i) {
                const glm::dvec3 at(i % 8 - 3.5, 0.3, 0.8 * (i / 8) - 2);
                balls.push_back(
                    scene.createEntity("/Small", glm::translate(glm::dmat4(1), at), i < 5 ? group : Entity{}));
                scene.world.add(balls.back(), SphereInstance{0.2f, i == 39 ? glow : red});
            }
        }
        void move(Entity entity, const glm::dmat4& by) {
            glm::dmat4& place = scene.world.modify<LocalTransform>(entity)->parentFromLocal;
            place = place * by;
        }
        void change(int step) {
            const auto shift = [](double x, double y, double z) { return glm::translate(glm::dmat4(1), {x, y, z}); };
            if (step == 1) move(balls[20], shift(0.3, 1, 0));
            if (step == 2) move(ball, shift(1, 0.5, 0)), move(balls[7], shift(0, 0.5, 0.5));
            if (step == 3) move(group, shift(0, 0.7, 0.2));
            if (step == 4) move(balls[20], glm::scale(glm::dmat4(1), glm::dvec3(0))); // can't be hit
            if (step == 5) move(balls[39], shift(0, 1, 0)), move(balls[3], shift(0, 0.2, 0));
            if (step == 6) move(lamp, shift(0.5, 0, 0));
            if (step == 7) scene.world.destroy(balls[12]), move(balls[13], shift(0, 0.3, 0));
            if (step == 8) move(balls[14], shift(0, 0.4, 0));
            if (step == 9) scene.world.add(balls[15], Visibility{.visible = false});
            if (step == 10) move(camera, shift(0.1, 0, 0));
            // A lamp that shrinks to nothing and grows again.
            const auto placed = [&]() -> glm::dmat4& {
                return scene.world.modify<LocalTransform>(lamp)->parentFromLocal;
            };
            if (step == 11) grown = std::exchange(placed(), glm::scale(glm::dmat4(1), glm::dvec3(0)));
            if (step == 12) placed() = grown;
        }
        Entity group;
        glm::dmat4 grown{1};
        std::vector<Entity> balls;
    };
    const auto shoot = [](View& view) {
        view.setSeed(5);
        return view.render({.spp = 1});
    };
    Crowd followed;
    View view(engine(), followed.scene, 48, 32, "");
    view.setTechnique("pathtrace");
    for (int step = 0; step <= 13; ++step) { // the last one: nothing moves any more
        followed.change(step);
        Crowd fresh;
        for (int before = 0; before <= step; ++before) fresh.change(before);
        View freshView(engine(), fresh.scene, 48, 32, "");
        freshView.setTechnique("pathtrace");
        SCOPED_TRACE(step);
        const ImageData picture = shoot(view), expected = shoot(freshView);
        if (step != 11) {
            expectSame(picture, expected);
            continue;
        }
        // The fresh one's kernels know of no lamps of that kind, and round otherwise.
        for (size_t i = 0; i < expected.pixels.size(); ++i)
            ASSERT_NEAR(picture.pixels[i], expected.pixels[i], 1e-4f * (1 + expected.pixels[i]));
    }
}

TEST_F(RendererTest, RemovedLightIsGoneAtOnce) {
    Room room;
    View view(engine(), room.scene, 32, 32, "");
    view.setTechnique("pathtrace");
    EXPECT_GT(mean(view.render({.spp = 4})), 0.01);
    room.scene.world.destroy(room.lamp);
    EXPECT_EQ(mean(view.render({.spp = 4})), 0.0);
    const auto& nodes = view.stats().nodes;
    const auto pathtrace =
        std::find_if(nodes.begin(), nodes.end(), [](const auto& n) { return n.name == "pathtrace"; });
    ASSERT_NE(pathtrace, nodes.end());
    EXPECT_EQ(pathtrace->state, "skipped");
    EXPECT_EQ(pathtrace->reason, "no lights");
}

// A normal map that leans towards +t shades alike however s runs, and on mirrored instances.
TEST_F(RendererTest, NormalMapsFollowMirroredTextureCoordinates) {
    const auto brightness = [](bool mirroredTexture, bool mirroredInstance, float lean) {
        Scene scene;
        Texture texture;
        texture.name = "lean";
        texture.width = texture.height = 1;
        texture.rgba32f = {0, 0.6f * lean, 0.8f, 1};
        Material m = lambert(glm::vec3(0.5f));
        m.normalMap.texture = scene.addTexture(texture);
        Mesh floor = quad("/Floor", {-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}); // t along -z
        const float s0 = mirroredTexture ? 1 : 0, s1 = 1 - s0;
        floor.uvs = {{s0, 0}, {s1, 0}, {s1, 1}, {s0, 0}, {s1, 1}, {s0, 1}};
        const glm::dvec3 scale(mirroredInstance ? -1 : 1, 1, 1);
        scene.world.add(scene.createEntity("/Quad", glm::scale(glm::dmat4(1), scale)),
                        MeshInstance{scene.addMesh(floor), {scene.addMaterial(m)}});
        Light sun; // from above and -z
        sun.kind = LightKind::Distant;
        scene.world.add(scene.createEntity("/Sun", glm::rotate(glm::dmat4(1), glm::radians(-135.0), {1, 0, 0})), sun);
        addCamera(scene, {0, 2, 0.1}, {0, 0, 0});
        View view(engine(), scene, 8, 8, "");
        view.setTechnique("raytrace");
        return mean(view.render({.spp = 1}));
    };
    const double towards = brightness(false, false, 1), away = brightness(false, false, -1);
    EXPECT_NEAR(towards / away, 1.4 / 0.2, 0.01); // (0.8 + 0.6) / (0.8 - 0.6) under 45 degrees
    EXPECT_NEAR(brightness(true, false, 1), towards, 1e-4 * towards);
    EXPECT_NEAR(brightness(false, true, 1), towards, 1e-4 * towards);
    EXPECT_NEAR(brightness(true, true, 1), towards, 1e-4 * towards);
}

/// Light samples change the noise and not the picture: the means agree within 4.5 standard deviations of their
/// difference.
void expectLightSamplesAreUnbiased(Scene& scene) {
    double means[2], variance = 0;
    for (const int nee : {0, 1}) {
        View view(engine(), scene, 32, 24, "");
        view.setTechnique("pathtrace");
        view.params().set("sampler.sequence", "independent"); // what the variance AOV assumes
        view.params().set("pathtrace.nee", std::to_string(nee));
        view.setSeed(static_cast<uint64_t>(nee));
        view.setAovs({"variance"});
        means[nee] = mean(view.render({.spp = nee ? 128u : 512u}));
        EXPECT_EQ(view.stats().nonfinite, 0u);
        for (const float v : view.aov("variance").pixels) variance += v;
    }
    EXPECT_GT(means[0], 0.0);
    EXPECT_LT(std::abs(means[1] - means[0]), 4.5 * std::sqrt(variance) / (32 * 24)) << means[1] << ", " << means[0];
}

Mesh quadMesh(float r) { return quad("/Quad", {-r, 0, -r}, {r, 0, -r}, {r, 0, r}, {-r, 0, r}); } // faces -y

TEST_F(RendererTest, EmittersThatAreCutOutEmitByTheirOpacity) {
    Material half = lambert(glm::vec3(0), glm::vec3(5));
    half.opacity = 0.5f;
    for (const bool sphere : {false, true}) {
        SCOPED_TRACE(sphere ? "sphere" : "mesh");
        Room room;
        room.scene.world.destroy(room.lamp);
        room.scene.world.destroy(room.ball);
        const MaterialId material = room.scene.addMaterial(half);
        const Entity emitter = room.scene.createEntity("/Emitter", glm::translate(glm::dmat4(1), {0, 1, 0}));
        if (sphere)
            room.scene.world.add(emitter, SphereInstance{0.5f, material});
        else
            room.scene.world.add(emitter, MeshInstance{room.scene.addMesh(quadMesh(0.5f)), {material}});
        expectLightSamplesAreUnbiased(room.scene);
    }
}

TEST_F(RendererTest, ATexturedSphereCanBeTheOnlyLight) {
    Room room;
    room.scene.world.destroy(room.lamp);
    Texture stripes;
    stripes.name = "stripes";
    stripes.width = 2;
    stripes.height = 1;
    stripes.rgba32f = {1, 1, 1, 1, 9, 9, 9, 1};
    Material glow = lambert(glm::vec3(0), glm::vec3(1));
    glow.emissionMap.texture = room.scene.addTexture(stripes);
    room.scene.world.modify<SphereInstance>(room.ball)->material = room.scene.addMaterial(glow);
    expectLightSamplesAreUnbiased(room.scene);
}

// Rays leave large surfaces far off; what they aim at must not move along with them.
TEST_F(RendererTest, ALargeCutOutPlaneLetsLightThrough) {
    Room room;
    Material half = lambert(glm::vec3(0.5f));
    half.opacity = 0.5f;
    const Entity plane = room.scene.createEntity("/Plane", glm::translate(glm::dmat4(1), {0, 3, 0}));
    room.scene.world.add(plane, MeshInstance{room.scene.addMesh(quadMesh(3000)), {room.scene.addMaterial(half)}});
    expectLightSamplesAreUnbiased(room.scene);
}

// A camera that moves by one pixel's width sees everything move by one pixel, in each of the frames that are averaged.
TEST_F(RendererTest, MotionIsThatBetweenPictures) {
    Scene scene;
    Mesh wall;
    wall.name = "/Wall";
    wall.positions = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
    wall.triangles = {{0, 1, 2}, {0, 2, 3}};
    const MaterialId grey = scene.addMaterial(lambert(glm::vec3(0.5f)));
    scene.world.add(scene.createEntity("/Wall"), MeshInstance{scene.addMesh(wall), {grey}});
    const Entity camera = addCamera(scene, {0, 0, 4}, {0, 0, 0}); // 4 units of wall across 32 pixels
    View view(engine(), scene, 32, 32, "");
    view.setTechnique("pathtrace");
    view.setAovs({"motion"});
    view.render({.spp = 3});
    for (const float x : view.aov("motion").pixels) EXPECT_EQ(x, 0);
    scene.world.modify<LocalTransform>(camera)->parentFromLocal[3].x = 4.0 / 32;
    view.render({.spp = 3});
    const ImageData motion = view.aov("motion");
    for (size_t i = 0; i < motion.pixels.size(); i += 2) {
        EXPECT_NEAR(motion.pixels[i], -1, 1e-3);
        EXPECT_NEAR(motion.pixels[i + 1], 0, 1e-3);
    }
    view.render({.spp = 3});
    for (const float x : view.aov("motion").pixels) EXPECT_EQ(x, 0);
}

// Far from the world's origin as near it: render space is centred on the scene.
TEST_F(RendererTest, DistanceFromTheOriginDoesNotMatter) {
    Scene near, far;
    fillFurnace(near, 0.5f, 1);
    fillFurnace(far, 0.5f, 1, 1, glm::dvec3(65536, -65536, 32768));
    View nearView(engine(), near, 32, 32, ""), farView(engine(), far, 32, 32, "");
    nearView.setTechnique("pathtrace");
    farView.setTechnique("pathtrace");
    const ImageData a = nearView.render({.spp = 64}), b = farView.render({.spp = 64});
    EXPECT_NEAR(mean(a), mean(b), 1e-4 * mean(a));
}

TEST_F(RendererTest, ScaleDoesNotMatter) {
    Scene unit;
    fillFurnace(unit, 0.5f, 1);
    View unitView(engine(), unit, 32, 32, "");
    unitView.setTechnique("pathtrace");
    const double expected = mean(unitView.render({.spp = 64}));
    for (const double scale : {1e-5, 1e-3, 1e3, 1e5}) {
        Scene scene;
        fillFurnace(scene, 0.5f, 1, scale);
        View view(engine(), scene, 32, 32, "");
        view.setTechnique("pathtrace");
        EXPECT_NEAR(mean(view.render({.spp = 64})), expected, 1e-3 * expected) << "scale " << scale;
    }
}

TEST_F(RendererTest, AnEmptySceneIsBlackAndNothingBreaks) {
    Scene scene;
    View view(engine(), scene, 16, 16, "");
    view.setTechnique("pathtrace");
    EXPECT_EQ(mean(view.render({.spp = 2})), 0.0);
}

// The device has one place for the top-level structure that ray queries trace.
TEST_F(RendererTest, ViewsOfDifferentScenesTakeTurns) {
    if (!engine().device().rayQuery()) GTEST_SKIP() << "no ray queries";
    EngineOptions options;
    options.tracer = gpu::Tracer::Query;
    Engine queries{options};
    Room room, empty;
    empty.scene.world.destroy(empty.ball);
    View view(queries, room.scene, 32, 24, "");
    view.setTechnique("raytrace");
    const ImageData before = view.render({.spp = 1});
    {
        View other(queries, empty.scene, 32, 24, "");
        other.setTechnique("pathtrace");
        other.render({.spp = 1});
        view.setSeed(0);
        expectSame(view.render({.spp = 1}), before);
    }
    view.setSeed(0);
    expectSame(view.render({.spp = 1}), before);
}

// What TearDown asks of all tests is the point here: no message of the validation layers from any node, on a first
// frame, in a still scene, and after a move.
TEST_F(RendererTest, EveryTechniqueKeepsTheRulesOfVulkan) {
    for (const Technique& technique : engine().registry().techniques()) {
        SCOPED_TRACE(technique.name);
        Room room;
        Material glass = lambert(glm::vec3(1));
        glass.ior = 1.5f;
        glass.transmission = 1;
        glass.roughness = 0;
        room.scene.world.add(room.scene.createEntity("/Lens", glm::translate(glm::dmat4(1), {1.2, 1, 1})),
                             SphereInstance{0.5f, room.scene.addMaterial(glass)});
        View view(engine(), room.scene, 16, 16, "");
        view.setTechnique(technique.name);
        view.params().set("denoise.mode", "temporal");
        if (std::count(technique.nodes.begin(), technique.nodes.end(), "restir_di") > 0)
            view.params().set("restir_di.reuse", "spatiotemporal");
        for (const double x : {0.0, 0.0, 0.3}) {
            room.scene.world.modify<LocalTransform>(room.ball)->parentFromLocal[3].x = x;
            EXPECT_GT(mean(view.render({.spp = 2})), 0);
            EXPECT_EQ(view.stats().nonfinite, 0u);
        }
    }
}

TEST_F(RendererTest, RemovedCameraIsAnError) {
    Room room;
    View view(engine(), room.scene, 16, 16, "");
    view.setTechnique("pathtrace");
    view.render({.spp = 1});
    room.scene.world.destroy(room.camera);
    EXPECT_THROW(view.render({.spp = 1}), Error);
}

TEST_F(RendererTest, SwitchedOffNodesSaySoAndComeBack) {
    Room room;
    View view(engine(), room.scene, 32, 32, "");
    view.setTechnique("pathtrace");
    const ImageData before = view.render({.spp = 2});
    view.setNodeEnabled("pathtrace", false);
    view.render({.spp = 2});
    EXPECT_EQ(view.stats().nodes[1].state, "skipped");
    EXPECT_EQ(view.stats().unowned, (std::vector<std::string>{"direct", "caustic", "indirect"}));
    view.setNodeEnabled("pathtrace", true);
    EXPECT_NEAR(mean(view.render({.spp = 2})), mean(before), 0.2 * mean(before));
}

} // namespace
} // namespace trilume
