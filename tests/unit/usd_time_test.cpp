#include "usd_stage_fixture.h"

#include <cmath>

// Time: what varies follows it, and only what differs counts as changed.
namespace trilume::usd {
namespace {

const std::string kRange = "metersPerUnit = 1\nstartTimeCode = 1\nendTimeCode = 3\ntimeCodesPerSecond = 30";

class UsdTime : public UsdStage {
protected:
    template<class C>
    static size_t changes(const Scene& scene, Tick since) {
        size_t count = 0;
        scene.world.eachChanged<C>(since, [&](Entity, const C&) { ++count; });
        return count;
    }
};

TEST_F(UsdTime, RangeAndStart) {
    const auto scene =
        read("def Sphere \"s\"\n{\ndouble3 xformOp:translate.timeSamples = { 1: (1, 0, 0), 3: (3, 0, 0) }\n"
             "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}\n",
             kRange);
    EXPECT_EQ(scene->startTime, 1.0);
    EXPECT_EQ(scene->endTime, 3.0);
    EXPECT_EQ(scene->timeCodesPerSecond, 30);
    expectNear(position(*scene, "/s"), {1, 0, 0});
    scene->setTime(2);
    scene->updateTransforms();
    expectNear(position(*scene, "/s"), {2, 0, 0});
}

TEST_F(UsdTime, WithoutARangeTheFirstSamplesShow) {
    const auto scene = read("def Mesh \"m\"\n{\npoint3f[] points.timeSamples = { 5: [(0,0,0),(1,0,0),(0,1,0)], 6: "
                            "[(0,0,0),(2,0,0),(0,1,0)] }\n"
                            "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n}\n");
    EXPECT_FALSE(scene->startTime);
    EXPECT_EQ(meshOf(*scene, "/m").positions[1], glm::vec3(1, 0, 0));
}

TEST_F(UsdTime, OnlyWhatDiffersChanges) {
    const auto scene = read("def Xform \"moving\"\n{\ndouble3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (1, "
                            "0, 0), 3: (1, 0, 0) }\n"
                            "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" +
                                square("m") + "}\n" + square("still") +
                                "def RectLight \"l\"\n{\nfloat inputs:intensity.timeSamples = { 1: 1, 2: 5, 3: 5 "
                                "}\n}\ndef RectLight \"k\" {}\n",
                            kRange);
    Tick before = scene->world.now();
    scene->setTime(1);
    EXPECT_EQ(scene->world.now(), before) << "the same time: no change at all";
    scene->setTime(2);
    EXPECT_EQ(changes<LocalTransform>(*scene, before), 1u);
    EXPECT_EQ(changes<Light>(*scene, before), 1u);
    EXPECT_EQ(changes<MeshInstance>(*scene, before), 0u);
    EXPECT_EQ(get<Light>(*scene, "/l").radiance, glm::vec3(5));
    before = scene->world.now();
    scene->setTime(3);
    EXPECT_EQ(scene->world.now(), before) << "equal samples: no change at all";
}

TEST_F(UsdTime, SampleTimesAreThoseOfAllThatVaries) {
    const auto scene =
        read("class Xform \"proto\"\n{\ndef Sphere \"s\"\n{\ndouble radius.timeSamples = { 2: 1, 7.5: 2 }\n}\n}\n"
             "def Xform \"a\" (instanceable = true\nprepend references = </proto>)\n{\n"
             "token visibility.timeSamples = { -1: \"inherited\", 2: \"invisible\" }\n}\n"
             "def SphereLight \"still\"\n{\nfloat inputs:intensity.timeSamples = { 99: 1 }\n}\n",
             kRange);
    ASSERT_NE(scene->source, nullptr);
    EXPECT_EQ(scene->source->sampleTimes(), (std::vector<double>{-1, 2, 7.5}))
        << "one sample alone says nothing of time";
}

TEST_F(UsdTime, StaticStagesHaveNoSource) { EXPECT_EQ(read(square("m"), kRange)->source, nullptr); }

TEST_F(UsdTime, VisibilityOfAncestors) {
    const auto scene =
        read("def Xform \"a\"\n{\ntoken visibility.timeSamples = { 1: \"invisible\", 2: \"inherited\" }\n" +
                 square("m") + "def SphereLight \"l\" {}\n}\n",
             kRange);
    EXPECT_FALSE(scene->isVisible(find(*scene, "/a/m")));
    EXPECT_FALSE(scene->isVisible(find(*scene, "/a/l")));
    scene->setTime(2);
    scene->updateTransforms();
    EXPECT_TRUE(scene->isVisible(find(*scene, "/a/m")));
    EXPECT_TRUE(scene->isVisible(find(*scene, "/a/l")));
    scene->setTime(1);
    scene->updateTransforms();
    EXPECT_FALSE(scene->isVisible(find(*scene, "/a/m")));
}

TEST_F(UsdTime, ASingleSampleHoldsAtAllTimes) {
    const std::string red = "color3f[] primvars:displayColor.timeSamples = { 1: [(1, 0, 0)] }\n";
    const std::string blue = "color3f[] primvars:displayColor.timeSamples = { 1: [(0, 0, 1)] }\n";
    const std::string instance = " (instanceable = true\nprepend references = </proto>)\n{\n";
    const auto scene = read("def Xform \"a\"\n{\ntoken visibility.timeSamples = { 1: \"invisible\" }\n" + square("m") +
                                "}\nclass Xform \"proto\"\n{\n" + square("m") + "}\ndef Xform \"r\"" + instance + red +
                                "}\ndef Xform \"b\"" + instance + blue + "}\n",
                            kRange);
    EXPECT_EQ(scene->world.count<MeshInstance>(), 2u) << "what is under /a is never seen";
    EXPECT_EQ(materialOf(*scene, "/r/m").baseColor, glm::vec3(1, 0, 0));
    EXPECT_EQ(materialOf(*scene, "/b/m").baseColor, glm::vec3(0, 0, 1));
}

TEST_F(UsdTime, DeformingMeshesKeepTheirTopology) {
    const auto scene = read("def Mesh \"m\"\n{\npoint3f[] points.timeSamples = { 1: [(0,0,0),(1,0,0),(1,1,0),(0,1,0)], "
                            "2: [(0,0,0),(1,0,0),(1,1,3),(0,1,0)], 3: [(0,0,0),(1,0,0),(1,1,3),(0,1,0)] }\n"
                            "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3]\n}\n",
                            kRange);
    const Mesh& mesh = meshOf(*scene, "/m");
    EXPECT_TRUE(mesh.deforming);
    const auto topology = mesh.topologyRevision, points = mesh.pointsRevision;
    const glm::vec3 normal = mesh.normals[0];
    scene->setTime(2);
    EXPECT_EQ(mesh.positions[2].z, 3);
    EXPECT_NE(mesh.normals[0], normal);
    EXPECT_EQ(mesh.topologyRevision, topology);
    EXPECT_EQ(mesh.pointsRevision, points + 1);
    scene->setTime(3);
    EXPECT_EQ(mesh.pointsRevision, points + 1) << "the same points";
}

TEST_F(UsdTime, TopologyMayChange) {
    const auto scene = read("def Mesh \"m\"\n{\npoint3f[] points.timeSamples = { 1: [(0,0,0),(1,0,0),(1,1,0)], 2: "
                            "[(0,0,0),(1,0,0),(1,1,0),(0,1,0)] }\n"
                            "int[] faceVertexCounts.timeSamples = { 1: [3], 2: [4] }\nint[] "
                            "faceVertexIndices.timeSamples = { 1: [0, 1, 2], 2: [0, 1, 2, 3] }\n}\n",
                            kRange);
    const Mesh& mesh = meshOf(*scene, "/m");
    EXPECT_EQ(mesh.triangles.size(), 1u);
    const auto topology = mesh.topologyRevision;
    scene->setTime(2);
    EXPECT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.topologyRevision, topology + 1);
    EXPECT_EQ(allWarnings(), "");
}

/// As simulations do.
TEST_F(UsdTime, MeshesMayBeEmptyForAWhile) {
    const auto scene =
        read("def Mesh \"all\"\n{\npoint3f[] points.timeSamples = { 1: [], 2: [(0,0,0),(1,0,0),(1,1,0)], "
             "3: [] }\nint[] faceVertexCounts.timeSamples = { 1: [], 2: [3], 3: [] }\nint[] "
             "faceVertexIndices.timeSamples = { 1: [], 2: [0, 1, 2], 3: [] }\n}\n"
             "def Mesh \"points\"\n{\npoint3f[] points.timeSamples = { 1: None, 2: "
             "[(0,0,0),(1,0,0),(1,1,0)], 3: None, 4: [(0,0,0),(1,0,0),(1,1,3)] }\n"
             "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]\n}\n",
             kRange);
    const auto seen = [&](double time) {
        scene->setTime(time);
        scene->updateTransforms();
        return scene->isVisible(find(*scene, "/all")) + 2 * scene->isVisible(find(*scene, "/points"));
    };
    EXPECT_FALSE(scene->isVisible(find(*scene, "/all")));
    EXPECT_FALSE(scene->isVisible(find(*scene, "/points")));
    EXPECT_EQ(seen(2), 3);
    EXPECT_EQ(meshOf(*scene, "/all").triangles.size(), 1u);
    EXPECT_EQ(seen(3), 0);
    EXPECT_EQ(seen(4), 2);
    EXPECT_EQ(meshOf(*scene, "/points").positions[2].z, 3);
    EXPECT_EQ(seen(1), 0);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdTime, BlockedSamplesHaveTheSchemasFallback) {
    const auto scene = read("def Camera \"c\"\n{\nfloat focalLength.timeSamples = { 1: None, 2: 80 }\n}\n"
                            "def Sphere \"s\"\n{\ndouble radius.timeSamples = { 1: None, 2: 4 }\n}\n"
                            "def RectLight \"l\"\n{\nfloat inputs:width.timeSamples = { 1: None, 2: 4 }\n}\n",
                            "metersPerUnit = 0.01\nstartTimeCode = 1\nendTimeCode = 2");
    EXPECT_FLOAT_EQ(get<Camera>(*scene, "/c").focalLength, 50);
    EXPECT_EQ(get<SphereInstance>(*scene, "/s").radius, 1);
    EXPECT_EQ(get<Light>(*scene, "/l").width, 1);
    scene->setTime(2);
    EXPECT_FLOAT_EQ(get<Camera>(*scene, "/c").focalLength, 80);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdTime, ShapesWithoutExtentHideForAWhile) {
    const auto scene = read("def Sphere \"s\"\n{\ndouble radius.timeSamples = { 1: 0, 2: 4 }\n}\n"
                            "def Cube \"q\"\n{\ndouble size.timeSamples = { 1: 0, 2: 4 }\n}\n",
                            kRange);
    EXPECT_FALSE(scene->isVisible(find(*scene, "/s")));
    EXPECT_FALSE(scene->isVisible(find(*scene, "/q")));
    scene->setTime(2);
    scene->updateTransforms();
    EXPECT_TRUE(scene->isVisible(find(*scene, "/s")));
    EXPECT_TRUE(scene->isVisible(find(*scene, "/q")));
    EXPECT_EQ(std::abs(meshOf(*scene, "/q").positions[0].x), 2);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdTime, WhatIsWrongWithAMeshIsSaidOnce) {
    const auto scene =
        read("def Mesh \"m\"\n{\npoint3f[] points = [(0,0,0),(1,0,0),(1,1,0)]\n"
             "int[] faceVertexCounts.timeSamples = { 1: [3, 3], 2: [3, 3, 3] }\nint[] "
             "faceVertexIndices.timeSamples = { 1: [0, 1, 2, 0, 1, 9], 2: [0, 1, 2, 0, 1, 9, 0, 1, 9] }\n}\n",
             kRange);
    EXPECT_TRUE(warned("/m: 1 faces have point indices out of range"));
    scene->setTime(2);
    EXPECT_EQ(warnings_.size(), 1u) << allWarnings();
}

TEST_F(UsdTime, CamerasSpheresAndMaterials) {
    const auto scene =
        read("def Camera \"c\"\n{\nfloat focalLength.timeSamples = { 1: 50, 2: 80 }\n}\n"
             "def Sphere \"s\"\n{\ndouble radius.timeSamples = { 1: 1, 2: 4 }\nrel material:binding = </mat>\n}\n"
             "def Cube \"q\"\n{\ndouble size.timeSamples = { 1: 1, 2: 4 }\n}\n"
             "def Material \"mat\"\n{\ncolor3f inputs:tint.timeSamples = { 1: (1, 0, 0), 2: (0, 1, 0) }\n"
             "token outputs:surface.connect = </mat/s.outputs:surface>\ndef Shader \"s\"\n{\nuniform token info:id = "
             "\"UsdPreviewSurface\"\n"
             "color3f inputs:diffuseColor.connect = </mat.inputs:tint>\ntoken outputs:surface\n}\n}\n",
             "metersPerUnit = 0.01\nstartTimeCode = 1\nendTimeCode = 2");
    EXPECT_FLOAT_EQ(get<Camera>(*scene, "/c").focalLength, 50);
    const MaterialId id = get<SphereInstance>(*scene, "/s").material;
    EXPECT_EQ(scene->material(id).baseColor, glm::vec3(1, 0, 0));
    const auto revision = scene->material(id).revision;
    scene->setTime(1);
    EXPECT_EQ(scene->material(id).revision, revision);
    scene->setTime(2);
    EXPECT_EQ(scene->material(id).baseColor, glm::vec3(0, 1, 0));
    EXPECT_EQ(scene->material(id).revision, revision + 1);
    EXPECT_FLOAT_EQ(get<Camera>(*scene, "/c").focalLength, 80);
    EXPECT_EQ(get<SphereInstance>(*scene, "/s").radius, 4);
    EXPECT_EQ(std::abs(meshOf(*scene, "/q").positions[0].x), 2);
    EXPECT_EQ(meshOf(*scene, "/q").topologyRevision, 1u);
}

TEST_F(UsdTime, TexturesThatAreNoLongerShownMakeRoom) {
    for (const char* name : {"a.png", "b.png", "c.png"}) write(name, "x");
    const auto scene =
        read("def RectLight \"l\"\n{\nasset inputs:texture:file.timeSamples = { 1: @a.png@, 2: @b.png@, 3: "
             "@c.png@ }\n}\n" +
                 square("m"),
             kRange);
    for (int round = 0; round < 3; ++round)
        for (int time = 1; time <= 3; ++time) {
            scene->setTime(time);
            const Texture& texture = scene->texture(get<Light>(*scene, "/l").texture);
            EXPECT_EQ(std::filesystem::path(texture.name).stem(), std::string(1, static_cast<char>('a' + time - 1)));
        }
    EXPECT_EQ(scene->textures().size(), 2u) << "the last one, and the one before while it was read";
    EXPECT_GT(scene->textures()[0].revision, 1u);
}

TEST_F(UsdTime, PointInstancersGrowAndShrink) {
    const auto scene = read(R"(
def PointInstancer "p"
{
    rel prototypes = </p/ball>
    int[] protoIndices.timeSamples = { 1: [0], 2: [0, 0, 0], 3: [0, 0] }
    point3f[] positions.timeSamples = { 1: [(1, 0, 0)], 2: [(1, 0, 0), (2, 0, 0), (3, 0, 0)], 3: [(5, 0, 0), (6, 0, 0)] }
    def Sphere "ball" {}
}
)",
                            kRange);
    EXPECT_EQ(scene->world.count<SphereInstance>(), 1u);
    scene->setTime(2);
    scene->updateTransforms();
    EXPECT_EQ(scene->world.count<SphereInstance>(), 3u);
    expectNear(position(*scene, "/p[2]"), {3, 0, 0});
    scene->setTime(3);
    scene->updateTransforms();
    EXPECT_EQ(scene->world.count<SphereInstance>(), 2u);
    expectNear(position(*scene, "/p[0]"), {5, 0, 0});
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdTime, MovingInstances) {
    const auto scene = read("class Xform \"proto\"\n{\n" + square("m") +
                                "}\ndef Xform \"a\" (instanceable = true\nprepend references = </proto>)\n{\n"
                                "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (4, 0, 0) }\nuniform "
                                "token[] xformOpOrder = [\"xformOp:translate\"]\n}\n"
                                "def Xform \"b\" (instanceable = true\nprepend references = </proto>)\n{\n}\n",
                            kRange);
    const Tick before = scene->world.now();
    scene->setTime(2);
    scene->updateTransforms();
    expectNear(position(*scene, "/a/m"), {4, 0, 0});
    expectNear(position(*scene, "/b/m"), {0, 0, 0});
    EXPECT_EQ(changes<LocalTransform>(*scene, before), 1u);
}

TEST_F(UsdTime, ScaleZeroHidesForAWhile) {
    const auto scene = read("def Sphere \"s\"\n{\ndouble3 xformOp:scale.timeSamples = { 1: (0, 0, 0), 2: (1, 1, 1) }\n"
                            "uniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n",
                            kRange);
    EXPECT_FALSE(scene->isVisible(find(*scene, "/s")));
    scene->setTime(2);
    scene->updateTransforms();
    EXPECT_TRUE(scene->isVisible(find(*scene, "/s")));
    EXPECT_EQ(allWarnings(), "");
}

} // namespace
} // namespace trilume::usd
