#include "core/error.h"
#include "core/log.h"
#include "scene/scene.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <random>

namespace trilume {
namespace {

glm::dmat4 at(double x, double y, double z) { return glm::translate(glm::dmat4(1), {x, y, z}); }

glm::dvec3 positionOf(const Scene& scene, Entity e) {
    return glm::dvec3(scene.world.find<WorldTransform>(e)->worldFromLocal[3]);
}

glm::dvec3 previousPositionOf(const Scene& scene, Entity e) {
    return glm::dvec3(scene.world.find<WorldTransform>(e)->previousWorldFromLocal[3]);
}

void move(Scene& scene, Entity e, const glm::dmat4& parentFromLocal) {
    scene.world.modify<LocalTransform>(e)->parentFromLocal = parentFromLocal;
}

/// Collects warnings while it lives.
struct CapturedLog {
    CapturedLog() {
        log::setLevel(log::Level::Info);
        log::setSink([this](log::Level, std::string_view line) { lines.emplace_back(line); });
    }
    ~CapturedLog() {
        log::setSink({});
        log::setLevel(log::Level::Warning);
    }
    std::vector<std::string> lines;
};

TEST(Hierarchy, ComposesParentsAndKeepsMotion) {
    Scene scene;
    const Entity parent = scene.createEntity("/p", at(1, 0, 0) * glm::scale(glm::dmat4(1), glm::dvec3(2)));
    const Entity child = scene.createEntity("/p/c", at(0, 3, 0), parent);
    EXPECT_EQ(scene.updateTransforms(), 2u);
    EXPECT_EQ(positionOf(scene, child), glm::dvec3(1, 6, 0));
    EXPECT_EQ(previousPositionOf(scene, child), glm::dvec3(1, 6, 0)) << "what just appeared does not move";

    move(scene, parent, at(5, 0, 0));
    EXPECT_EQ(scene.updateTransforms(), 2u);
    EXPECT_EQ(positionOf(scene, child), glm::dvec3(5, 3, 0));
    EXPECT_EQ(previousPositionOf(scene, child), glm::dvec3(1, 6, 0));

    const Tick moved = scene.world.now();
    EXPECT_EQ(scene.updateTransforms(), 0u);
    EXPECT_EQ(previousPositionOf(scene, child), glm::dvec3(5, 3, 0)) << "motion comes to rest";
    size_t changed = 0;
    scene.world.eachChanged<WorldTransform>(moved, [&](Entity, const WorldTransform&) { ++changed; });
    EXPECT_EQ(changed, 2u);

    const Tick rested = scene.world.now();
    scene.updateTransforms();
    EXPECT_EQ(scene.world.now(), rested) << "nothing is written when nothing changed";
}

TEST(Hierarchy, VisitsOnlyWhatChanged) {
    Scene scene;
    std::vector<Entity> roots, children;
    for (int i = 0; i < 100; ++i) {
        roots.push_back(scene.createEntity("/r"));
        for (int j = 0; j < 10; ++j) children.push_back(scene.createEntity("/r/c", at(j, 0, 0), roots.back()));
    }
    EXPECT_EQ(scene.updateTransforms(), 1100u);
    EXPECT_EQ(scene.updateTransforms(), 0u);
    move(scene, children[55], at(9, 9, 9));
    EXPECT_EQ(scene.updateTransforms(), 1u);
    move(scene, roots[7], at(1, 0, 0));
    EXPECT_EQ(scene.updateTransforms(), 11u);
    move(scene, roots[7], at(2, 0, 0));
    move(scene, children[70], at(2, 0, 0)); // Below roots[7]: visited once.
    EXPECT_EQ(scene.updateTransforms(), 11u);
    EXPECT_EQ(positionOf(scene, children[70]), glm::dvec3(4, 0, 0));
}

TEST(Hierarchy, DeepChains) {
    Scene scene;
    constexpr int kDepth = 200'000;
    Entity last;
    std::vector<Entity> chain;
    for (int i = 0; i < kDepth; ++i) chain.push_back(last = scene.createEntity("/n", at(1, 0, 0), last));
    EXPECT_EQ(scene.updateTransforms(), size_t{kDepth});
    EXPECT_EQ(positionOf(scene, last).x, kDepth);
    move(scene, chain.front(), at(11, 0, 0));
    EXPECT_EQ(scene.updateTransforms(), size_t{kDepth});
    EXPECT_EQ(positionOf(scene, last).x, kDepth + 10);
}

TEST(Hierarchy, ReparentingAndOrphans) {
    Scene scene;
    const Entity a = scene.createEntity("/a", at(10, 0, 0)), b = scene.createEntity("/b", at(20, 0, 0));
    const Entity child = scene.createEntity("/a/c", at(1, 0, 0), a);
    const Entity leaf = scene.createEntity("/a/c/l", at(0, 1, 0), child);
    scene.updateTransforms();
    scene.world.add(child, Parent{b});
    EXPECT_EQ(scene.updateTransforms(), 2u);
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(21, 1, 0));
    move(scene, a, at(0, 0, 0));
    EXPECT_EQ(scene.updateTransforms(), 1u) << "the old parent has let go";

    scene.world.destroy(b);
    EXPECT_EQ(scene.updateTransforms(), 2u);
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(1, 1, 0)) << "children of a destroyed parent become roots";
    const Entity reuse = scene.createEntity("/new", at(100, 0, 0));
    ASSERT_EQ(reuse.index, b.index);
    scene.updateTransforms();
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(1, 1, 0)) << "and don't hang on what took its index";

    scene.world.add(child, Parent{reuse});
    scene.updateTransforms();
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(101, 1, 0));
    scene.world.remove<Parent>(child);
    scene.updateTransforms();
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(1, 1, 0));
    scene.world.remove<LocalTransform>(child);
    scene.updateTransforms();
    EXPECT_EQ(scene.world.find<WorldTransform>(child), nullptr);
    EXPECT_EQ(positionOf(scene, leaf), glm::dvec3(0, 1, 0));
}

TEST(Hierarchy, DestroyedAndRecreatedBetweenTwoUpdates) {
    Scene scene;
    const Entity parent = scene.createEntity("/p", at(5, 0, 0));
    const Entity child = scene.createEntity("/p/c", at(1, 0, 0), parent);
    scene.updateTransforms();
    scene.world.destroy(parent);
    const Entity other = scene.createEntity("/q", at(7, 0, 0));
    ASSERT_EQ(other.index, parent.index);
    scene.updateTransforms();
    EXPECT_EQ(positionOf(scene, other), glm::dvec3(7, 0, 0));
    EXPECT_EQ(positionOf(scene, child), glm::dvec3(1, 0, 0));
}

TEST(Hierarchy, SwappingParentAndChildIsNoLoop) {
    Scene scene;
    const CapturedLog log;
    const Entity a = scene.createEntity("/a", at(1, 0, 0));
    const Entity b = scene.createEntity("/a/b", at(2, 0, 0), a);
    scene.updateTransforms();
    scene.world.add(a, Parent{b});
    scene.world.remove<Parent>(b);
    scene.updateTransforms();
    EXPECT_EQ(positionOf(scene, b), glm::dvec3(2, 0, 0));
    EXPECT_EQ(positionOf(scene, a), glm::dvec3(3, 0, 0));
    EXPECT_TRUE(log.lines.empty());
}

TEST(Hierarchy, LoopsAreBrokenWithAWarning) {
    Scene scene;
    CapturedLog log;
    const Entity a = scene.createEntity("/a", at(1, 0, 0)), b = scene.createEntity("/b", at(2, 0, 0), a);
    const Entity self = scene.createEntity("/self", at(4, 0, 0));
    scene.world.add(a, Parent{b});
    scene.world.add(self, Parent{self});
    EXPECT_EQ(scene.updateTransforms(), 3u);
    ASSERT_EQ(log.lines.size(), 2u);
    EXPECT_NE(log.lines[0].find("its own ancestor"), std::string::npos);
    EXPECT_EQ(positionOf(scene, self), glm::dvec3(4, 0, 0));
    EXPECT_EQ(std::max(positionOf(scene, a).x, positionOf(scene, b).x), 3) << "one of the two links holds";
}

/// Random edits, against a fresh scene that never saw the history.
TEST(Hierarchy, AgreesWithBruteForceUnderRandomEdits) {
    Scene scene;
    std::mt19937 random(3);
    std::vector<Entity> entities;
    for (int i = 0; i < 40; ++i) entities.push_back(scene.createEntity("/e", at(i, 0, 0)));
    for (int step = 0; step < 400; ++step) {
        for (int edit = 0; edit < 4; ++edit) {
            const size_t i = random() % entities.size();
            switch (random() % 5) {
            case 0: // Parents come earlier in the list, so no loops.
                if (i > 0) scene.world.add(entities[i], Parent{entities[random() % i]});
                break;
            case 1:
                scene.world.remove<Parent>(entities[i]);
                break;
            case 2:
                move(scene, entities[i], at(random() % 8, random() % 8, 0));
                break;
            case 3:
                scene.world.add(entities[i], Visibility{.visible = random() % 2 == 0});
                break;
            case 4:
                if (i + 1 < entities.size()) break;
                scene.world.destroy(entities[i]);
                entities[i] = scene.createEntity("/again", at(random() % 8, 0, 0), entities[random() % i]);
                break;
            }
        }
        scene.updateTransforms();
        for (const Entity e : entities) {
            glm::dvec3 position(0);
            bool visible = true;
            for (Entity up = e; scene.world.alive(up);) {
                position += glm::dvec3(scene.world.find<LocalTransform>(up)->parentFromLocal[3]);
                if (const auto* own = scene.world.find<Visibility>(up)) visible &= own->visible;
                const auto* parent = scene.world.find<Parent>(up);
                up = parent ? parent->entity : Entity{};
            }
            ASSERT_EQ(positionOf(scene, e), position) << "step " << step;
            ASSERT_EQ(scene.isVisible(e), visible) << "step " << step;
        }
    }
}

TEST(Visibility, IsInheritedAndMarksOnlyWhatChanged) {
    Scene scene;
    const Entity parent = scene.createEntity("/p"), child = scene.createEntity("/p/c", glm::dmat4(1), parent);
    const Entity other = scene.createEntity("/o");
    scene.updateTransforms();
    const Tick before = scene.world.now();
    scene.world.add(parent, Visibility{.visible = false, .shadow = false});
    scene.updateTransforms();
    EXPECT_FALSE(scene.isVisible(child));
    EXPECT_TRUE(scene.isVisible(other));
    EXPECT_FALSE(scene.world.find<InheritedVisibility>(child)->shadow);
    size_t moved = 0, changed = 0;
    scene.world.eachChanged<WorldTransform>(before, [&](Entity, const WorldTransform&) { ++moved; });
    scene.world.eachChanged<InheritedVisibility>(before, [&](Entity, const InheritedVisibility&) { ++changed; });
    EXPECT_EQ(moved, 0u);
    EXPECT_EQ(changed, 2u);
    scene.world.remove<Visibility>(parent);
    scene.updateTransforms();
    EXPECT_TRUE(scene.isVisible(child));
}

MeshId addBox(Scene& scene, float half) {
    Mesh mesh;
    for (const float x : {-half, half})
        for (const float y : {-half, half})
            for (const float z : {-half, half}) mesh.positions.emplace_back(x, y, z);
    mesh.positions.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0, 0);
    return scene.addMesh(std::move(mesh));
}

TEST(Bounds, CoverVisibleMeshesSpheresAndFiniteLights) {
    Scene scene;
    EXPECT_TRUE(scene.bounds().empty());
    const MeshId box = addBox(scene, 1);
    const Entity mesh = scene.createEntity("/mesh", at(10, 0, 0));
    scene.world.add(mesh, MeshInstance{box, {}});
    const Entity sphere = scene.createEntity("/sphere", glm::scale(at(0, 5, 0), glm::dvec3(1, 2, 3)));
    scene.world.add(sphere, SphereInstance{.radius = 2});
    const Entity sun = scene.createEntity("/sun", at(0, 0, 1000));
    scene.world.add(sun, Light{.kind = LightKind::Distant});
    const Entity lamp = scene.createEntity("/lamp", at(0, 0, -50));
    scene.world.add(lamp, Light{.kind = LightKind::Rect, .width = 4, .height = 2});
    const Entity hidden = scene.createEntity("/hidden", at(-100, 0, 0));
    scene.world.add(hidden, MeshInstance{box, {}});
    scene.world.add(hidden, Visibility{.visible = false});
    scene.updateTransforms();
    const Bounds b = scene.bounds();
    EXPECT_EQ(b.min, glm::dvec3(-2, -1, -50));
    EXPECT_EQ(b.max, glm::dvec3(11, 9, 6));

    for (glm::vec3& p : scene.editMesh(box).positions) p *= 3;
    EXPECT_EQ(scene.bounds().max.x, 11) << "as long as nobody says that the points changed";
    ++scene.editMesh(box).pointsRevision;
    EXPECT_EQ(scene.bounds().max.x, 13);
}

TEST(Bounds, FollowRandomEdits) {
    Scene scene;
    const MeshId boxes[2] = {addBox(scene, 1), addBox(scene, 2)};
    std::mt19937 random(3);
    std::uniform_real_distribution<double> coordinate(-20, 20);
    const auto somewhere = [&] { return at(coordinate(random), coordinate(random), coordinate(random)); };
    std::vector<Entity> entities;
    for (int i = 0; i < 40; ++i) {
        entities.push_back(scene.createEntity("/e", somewhere()));
        if (i % 4 < 2) scene.world.add(entities.back(), MeshInstance{boxes[i % 2], {}});
        if (i % 4 == 2) scene.world.add(entities.back(), SphereInstance{.radius = 1});
    }
    World& world = scene.world;
    for (int step = 0; step < 3000; ++step) {
        Entity& e = entities[random() % entities.size()];
        switch (random() % 32) {
        case 0:
            world.destroy(e);
            e = scene.createEntity("/e", somewhere(), random() % 3 == 0 ? entities.front() : Entity{});
            break;
        case 1:
            world.add(e, MeshInstance{boxes[random() % 2], {}});
            break;
        case 2:
            world.remove<MeshInstance>(e);
            break;
        case 3:
            world.add(e, Light{.kind = LightKind::Sphere, .radius = 3});
            break;
        case 4:
            world.remove<Light>(e);
            break;
        case 5:
            world.add(e, Visibility{.visible = random() % 2 == 0});
            break;
        case 6:
            ++scene.editMesh(boxes[0]).pointsRevision;
            scene.editMesh(boxes[0]).positions[0].x -= 0.1f;
            break;
        default:
            if (world.find<LocalTransform>(e)) move(scene, e, somewhere());
        }
        scene.updateTransforms();
        if (random() % 2 == 0) continue;
        const Bounds kept = scene.bounds(), fresh = SceneBounds().update(scene);
        ASSERT_EQ(kept.min, fresh.min) << step;
        ASSERT_EQ(kept.max, fresh.max) << step;
    }
}

TEST(Assets, EditingAMaterialGrowsItsRevision) {
    Scene scene;
    const MaterialId id = scene.addMaterial({.name = "/m"});
    const uint64_t before = scene.material(id).revision;
    scene.editMaterial(id).roughness = 0.1f;
    EXPECT_EQ(scene.material(id).revision, before + 1);
}

Entity addCamera(Scene& scene, std::string path) {
    const Entity e = scene.createEntity(std::move(path));
    scene.world.add(e, Camera{});
    return e;
}

TEST(ChooseCamera, ByPathByNameOnlyOneAndSettings) {
    Scene scene;
    scene.path = "x.usda";
    const Entity main = addCamera(scene, "/cameras/main");
    EXPECT_EQ(chooseCamera(scene, ""), main);
    const Entity side = addCamera(scene, "/cameras/side");
    EXPECT_EQ(chooseCamera(scene, "/cameras/side"), side);
    EXPECT_EQ(chooseCamera(scene, "main"), main);
    scene.renderSettings.camera = "/cameras/side";
    EXPECT_EQ(chooseCamera(scene, ""), side);
    addCamera(scene, "/other/main");
    const auto message = [&](const char* name) {
        try {
            chooseCamera(scene, name);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(message("front"), "unknown camera: front: choose one of: /cameras/main, /cameras/side, /other/main");
    EXPECT_EQ(message("main"), "several cameras have this name: main: give one's path: /cameras/main, /other/main");
}

TEST(ChooseCamera, FramesTheBoundsWhereThereIsNone) {
    Scene scene;
    scene.path = "x.usda";
    const Entity mesh = scene.createEntity("/mesh", at(3, -2, 1));
    scene.world.add(mesh, MeshInstance{addBox(scene, 2), {}});
    CapturedLog log;
    const Entity entity = chooseCamera(scene, "");
    EXPECT_EQ(chooseCamera(scene, ""), entity) << "made once";
    ASSERT_EQ(log.lines.size(), 1u);
    EXPECT_NE(log.lines[0].find("no camera in x.usda"), std::string::npos);

    scene.updateTransforms();
    const Camera& camera = *scene.world.find<Camera>(entity);
    const glm::dmat4 cameraFromWorld = glm::inverse(scene.world.find<WorldTransform>(entity)->worldFromLocal);
    double reach = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Bounds b = scene.bounds();
        const glm::dvec3 p(corner & 1 ? b.max.x : b.min.x, corner & 2 ? b.max.y : b.min.y,
                           corner & 4 ? b.max.z : b.min.z);
        const glm::dvec3 q = glm::dvec3(cameraFromWorld * glm::dvec4(p, 1));
        ASSERT_LT(q.z, 0);
        const double x = q.x / -q.z * camera.focalLength / (0.5 * camera.horizontalAperture);
        const double y = q.y / -q.z * camera.focalLength / (0.5 * camera.verticalAperture);
        reach = std::max({reach, std::abs(x), std::abs(y)});
    }
    EXPECT_LT(reach, 1) << "all of it is in the picture";
    EXPECT_GT(reach, 0.8) << "and fills it";
}

TEST(ChooseCamera, SeveralAndNoneChosenFramesAndSaysSo) {
    Scene scene;
    addCamera(scene, "/a");
    addCamera(scene, "/b");
    CapturedLog log;
    const Entity entity = chooseCamera(scene, "");
    EXPECT_NE(scene.world.find<Name>(entity)->path, "/a");
    ASSERT_EQ(log.lines.size(), 1u);
    EXPECT_NE(log.lines[0].find("/a, /b"), std::string::npos);
}

} // namespace
} // namespace trilume
