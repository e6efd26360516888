#include "usd_stage_fixture.h"

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_inverse.hpp>

#include <cmath>

// What a stage means: geometry, places, cameras, lights, settings. Materials, time and bad input have their own files.
namespace trilume::usd {
namespace {

TEST_F(UsdStage, UnitsAndUpAxisGoIntoTheRoot) {
    const auto scene = read("def Xform \"a\"\n{\n double3 xformOp:translate = (100, 200, 300)\n"
                            "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" +
                                square("m") + "}\n",
                            "metersPerUnit = 0.01\nupAxis = \"Z\"");
    expectNear(position(*scene, "/a/m"), {1, 3, -2});
    EXPECT_EQ(meshOf(*scene, "/a/m").positions[2], glm::vec3(1, 1, 0)) << "points are as the stage has them";
    EXPECT_EQ(scene->source, nullptr) << "nothing varies";
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, TransformsComposeInDoublePrecision) {
    const auto scene = read("def Xform \"far\"\n{\n double3 xformOp:translate = (100000000, 0, 0)\n"
                            "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n def Xform \"back\"\n{\n"
                            "double3 xformOp:translate = (-100000000, 0.001, 0)\n double xformOp:rotateZ = 90\n"
                            "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:rotateZ\"]\n" +
                            square("m") + "}\n}\n");
    expectNear(position(*scene, "/far/back/m", {1, 0, 0}), {0, 1.001, 0});
}

TEST_F(UsdStage, MeshesKeepPolygonsNormalsAndUvs) {
    const auto scene =
        read(square("flat", "uniform token subdivisionScheme = \"none\"\n") +
             square("smooth", "texCoord2f[] primvars:st = [(0,0),(1,0),(1,1),(0,1)] (interpolation = \"vertex\")\n") +
             square("given", "normal3f[] normals = [(0,0,2)] (interpolation = \"constant\")\n"
                             "normal3f[] primvars:normals = [(0,1,0)] (interpolation = \"constant\")\n") +
             square("indexed", "texCoord2f[] primvars:UVMap = [(5,6),(7,8)] (interpolation = \"faceVarying\")\n"
                               "int[] primvars:UVMap:indices = [1,0,0,0]\n"));
    EXPECT_TRUE(meshOf(*scene, "/flat").normals.empty());
    EXPECT_EQ(meshOf(*scene, "/smooth").normals.size(), 6u);
    ASSERT_EQ(meshOf(*scene, "/smooth").uvs.size(), 6u);
    ASSERT_EQ(meshOf(*scene, "/indexed").uvs.size(), 6u);
    EXPECT_EQ(meshOf(*scene, "/smooth").uvs[2], glm::vec2(1, 1));
    EXPECT_EQ(meshOf(*scene, "/given").normals[0], glm::vec3(0, 1, 0)) << "primvars:normals wins";
    EXPECT_EQ(meshOf(*scene, "/indexed").uvs[0], glm::vec2(7, 8));
    EXPECT_EQ(meshOf(*scene, "/indexed").uvs[1], glm::vec2(5, 6));
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, UvsOfOtherPrecisionsAreRead) {
    const auto scene = read(
        square("d", "texCoord2d[] primvars:st = [(0,0),(1,0),(1,1),(0,1)] (interpolation = \"vertex\")\n") +
        square("h", "texCoord2h[] primvars:st = [(0,0),(1,0),(1,1),(0,1)] (interpolation = \"vertex\")\n") +
        square("t", "texCoord3f[] primvars:st = [(0,0,9),(1,0,9),(1,1,9),(0,1,9)] (interpolation = \"vertex\")\n"));
    for (const char* path : {"/d", "/h", "/t"}) EXPECT_EQ(meshOf(*scene, path).uvs[2], glm::vec2(1, 1)) << path;
}

TEST_F(UsdStage, SpheresStayExactAndShapesBecomeMeshes) {
    const auto scene = read("def Sphere \"s\"\n{\ndouble radius = 2\n}\ndef Cube \"cube\"\n{\ndouble size = 3\n}\n"
                            "def Cylinder \"cylinder\" {}\ndef Cone \"cone\" {}\ndef Capsule \"capsule\" {}\n"
                            "def Cylinder_1 \"tube\"\n{\ndouble radiusTop = 3\n}\n"
                            "def Plane \"plane\"\n{\nuniform token axis = \"Y\"\ndouble width = 6\n}\n");
    EXPECT_EQ(get<SphereInstance>(*scene, "/s").radius, 2);
    EXPECT_EQ(std::abs(meshOf(*scene, "/cube").positions[0].x), 1.5f);
    for (const char* path : {"/cylinder", "/cone", "/capsule", "/tube"})
        EXPECT_GT(meshOf(*scene, path).triangles.size(), 100u) << path;
    EXPECT_EQ(meshOf(*scene, "/plane").normals[0], glm::vec3(0, 1, 0));
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, PurposeAndVisibilityAreInherited) {
    const auto scene =
        read("def Xform \"proxy\"\n{\nuniform token purpose = \"proxy\"\n" + square("m") +
             "def Mesh \"own\" (prepend references = </m>)\n{\nuniform token purpose = \"render\"\n}\n}\n"
             "def Xform \"guide\"\n{\nuniform token purpose = \"guide\"\n" +
             square("m") +
             "}\n"
             "def Xform \"off\"\n{\ntoken visibility = \"invisible\"\n" +
             square("m") + "def Camera \"c\" {}\n}\n" + square("m"));
    EXPECT_EQ(scene->world.count<MeshInstance>(), 2u);
    find(*scene, "/m");
    find(*scene, "/proxy/own");
    find(*scene, "/off/c");
}

TEST_F(UsdStage, InstancesShareOneMesh) {
    const std::string place =
        "double3 xformOp:translate = (X, 0, 0)\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    std::string prims = "class Xform \"proto\"\n{\ndef Xform \"inner\"\n{\ndouble3 xformOp:translate = (0, 5, 0)\n"
                        "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" +
                        square("m") + "}\ndef Sphere \"s\" {}\n}\n";
    for (const char* x : {"1", "2", "3"}) {
        std::string own = place;
        own.replace(own.find('X'), 1, x);
        prims += "def Xform \"i" + std::string(x) + "\" (instanceable = true\nprepend references = </proto>)\n{\n" +
                 own + "}\n";
    }
    const auto scene = read(prims);
    EXPECT_EQ(scene->meshes().size(), 1u);
    EXPECT_EQ(scene->world.count<MeshInstance>(), 3u);
    EXPECT_EQ(scene->world.count<SphereInstance>(), 3u);
    expectNear(position(*scene, "/i2/inner/m"), {2, 5, 0});
    expectNear(position(*scene, "/i3/s"), {3, 0, 0});
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, InstancesWithOtherBindingsHaveOtherMaterials) {
    const std::string red = "def Material \"red\"\n{\ntoken outputs:surface.connect = </red/s.outputs:surface>\n"
                            "def Shader \"s\"\n{\nuniform token info:id = \"UsdPreviewSurface\"\n"
                            "color3f inputs:diffuseColor = (1, 0, 0)\ntoken outputs:surface\n}\n}\n";
    const std::string head =
        " (instanceable = true\nprepend references = </proto>\nprepend apiSchemas = [\"MaterialBindingAPI\"])\n";
    const auto scene = read(red + "class Xform \"proto\"\n{\n" + square("m") + "}\ndef Xform \"a\"" + head +
                            "{\nrel material:binding = </red>\n}\ndef Xform \"b\"" + head + "{\n}\n");
    EXPECT_EQ(scene->meshes().size(), 1u);
    EXPECT_EQ(materialOf(*scene, "/a/m").baseColor, glm::vec3(1, 0, 0));
    EXPECT_EQ(materialOf(*scene, "/b/m").baseColor, glm::vec3(0.18f));
}

TEST_F(UsdStage, InstancesWithOtherPrimvarsHaveOtherMaterials) {
    const std::string tinted = R"(
def Material "mat"
{
    token outputs:surface.connect = </mat/s.outputs:surface>
    def Shader "s"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </mat/tint.outputs:result>
        token outputs:surface
    }
    def Shader "tint"
    {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        float3 outputs:result
    }
}
)";
    std::string prims = tinted + "class Xform \"proto\"\n{\n" + square("m", "rel material:binding = </mat>\n") + "}\n";
    for (const char* color : {"1, 0, 0", "0, 1, 0"})
        prims += "def Xform \"i" + std::string(1, color[0]) +
                 "\" (instanceable = true\nprepend references = </proto>)\n" + "{\ncolor3f[] primvars:tint = [(" +
                 color + ")]\n}\n";
    const auto scene = read(prims);
    EXPECT_EQ(scene->meshes().size(), 1u);
    EXPECT_EQ(materialOf(*scene, "/i1/m").baseColor, glm::vec3(1, 0, 0));
    EXPECT_EQ(materialOf(*scene, "/i0/m").baseColor, glm::vec3(0, 1, 0));
}

/// In an instance it stands in the world; in a prototype of point instances, with what is around it.
TEST_F(UsdStage, TransformStacksMayBeResetInsideInstances) {
    const auto sphere = [](std::string_view name) {
        return "def Sphere \"" + std::string(name) +
               "\"\n{\ndouble3 xformOp:translate = (0, 0, 7)\nuniform token[] "
               "xformOpOrder = [\"!resetXformStack!\", \"xformOp:translate\"]\n}\n";
    };
    const auto move = [](std::string_view to) {
        return "double3 xformOp:translate = (" + std::string(to) +
               ")\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    };
    const auto scene =
        read("class Xform \"proto\"\n{\n" + sphere("s") + "}\ndef Xform \"moved\"\n{\n" + move("0, 1, 0") +
             "def Xform \"i1\" (instanceable = true\nprepend references = </proto>)\n{\n" + move("1, 0, 0") +
             "}\ndef Xform \"i2\" (instanceable = true\nprepend references = </proto>)\n{\n" + move("2, 0, 0") +
             "}\n}\ndef PointInstancer \"p\"\n{\nrel prototypes = </p/kit>\nint[] protoIndices = [0, 0]\n"
             "point3f[] positions = [(5, 0, 0), (6, 0, 0)]\ndef Xform \"kit\"\n{\n" +
             move("0, 0, 3") + sphere("s") + "}\n}\n");
    expectNear(position(*scene, "/moved/i1/s"), {0, 0, 7});
    expectNear(position(*scene, "/moved/i2/s"), {0, 0, 7});
    expectNear(position(*scene, "/p[0]/s"), {5, 0, 7});
    expectNear(position(*scene, "/p[1]/s"), {6, 0, 7});
}

const char* const kInstancer = R"(
def PointInstancer "outer"
{
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</outer/Prototypes/ball>, </outer/Prototypes/row>]
    int[] protoIndices = [0, 1, 1, 0]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
    int64[] invisibleIds = [3]
    over "Prototypes"
    {
        def Sphere "ball"
        {
            double3 xformOp:scale = (2, 2, 2)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }
        def PointInstancer "row"
        {
            rel prototypes = </outer/Prototypes/row/card>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(0, 1, 0), (0, 2, 0)]
            def Mesh "card"
            {
                point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
                int[] faceVertexCounts = [3]
                int[] faceVertexIndices = [0, 1, 2]
            }
        }
    }
}
)";

TEST_F(UsdStage, PointInstancersNest) {
    const auto scene = read(kInstancer);
    EXPECT_EQ(scene->meshes().size(), 1u);
    EXPECT_EQ(scene->world.count<MeshInstance>(), 4u);
    EXPECT_EQ(scene->world.count<SphereInstance>(), 1u) << "one of two is invisible";
    expectNear(position(*scene, "/outer[0]", {1, 0, 0}), {3, 0, 10});
    expectNear(position(*scene, "/outer[2][1]"), {3, 2, 10});
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, PointInstancersInsideInstances) {
    std::string prims = "class Xform \"kit\"\n{\ndef PointInstancer \"pi\"\n{\nrel prototypes = </kit/pi/ball>\n"
                        "int[] protoIndices = [0, 0]\npoint3f[] positions = [(0, 1, 0), (0, 2, 0)]\n"
                        "def Sphere \"ball\" {}\n}\n}\n";
    for (const char* x : {"1", "2"})
        prims += "def Xform \"i" + std::string(x) + "\" (instanceable = true\nprepend references = </kit>)\n{\n" +
                 "double3 xformOp:translate = (" + x +
                 ", 0, 0)\nuniform token[] xformOpOrder = " + "[\"xformOp:translate\"]\n}\n";
    const auto scene = read(prims);
    EXPECT_EQ(scene->world.count<SphereInstance>(), 4u);
    expectNear(position(*scene, "/i1/pi[1]"), {1, 2, 0});
    expectNear(position(*scene, "/i2/pi[0]"), {2, 1, 0});
}

TEST_F(UsdStage, ChangedFilesAreReadAgain) {
    const std::string moving = "def Sphere \"s\"\n{\ndouble radius.timeSamples = { 1: 1, 2: 2 }\n}\n";
    const auto first = read(moving); // stays open: it varies
    const auto second = read(moving + "def Sphere \"t\" {}\n");
    EXPECT_EQ(second->world.count<SphereInstance>(), 2u);
    first->setTime(2);
    EXPECT_EQ(get<SphereInstance>(*first, "/s").radius, 2);
}

TEST_F(UsdStage, CamerasAreInMillimetresAndMetres) {
    const std::string camera =
        "def Camera \"c\"\n{\nfloat focalLength = 35\nfloat horizontalAperture = 36\nfloat verticalAperture = 24\n"
        "float horizontalApertureOffset = 2\nfloat2 clippingRange = (10, 2000)\nfloat fStop = 2.8\n"
        "float focusDistance = 150\ndouble3 xformOp:scale = (3, 3, 3)\n"
        "uniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n";
    const auto scene = read(camera + square("m"), "metersPerUnit = 0.01\nupAxis = \"Z\"");
    const auto c = get<Camera>(*scene, "/c");
    EXPECT_FLOAT_EQ(c.focalLength, 35);
    EXPECT_FLOAT_EQ(c.horizontalAperture, 36);
    EXPECT_FLOAT_EQ(c.horizontalOffset, 2);
    EXPECT_FLOAT_EQ(c.nearClip, 0.1f);
    EXPECT_FLOAT_EQ(c.farClip, 20);
    EXPECT_FLOAT_EQ(c.focusDistance, 1.5f);
    EXPECT_FLOAT_EQ(c.fStop, 2.8f);
    const glm::dmat3 rotation(get<WorldTransform>(*scene, "/c").worldFromLocal);
    expectNear(rotation[0], {1, 0, 0});
    expectNear(rotation[1], {0, 0, -1});
    expectNear(rotation[2], {0, 1, 0});
    // In a stage of metres the same numbers mean a lens a hundred times as large, in the same proportions.
    const auto metres = read(camera + square("m"));
    EXPECT_FLOAT_EQ(get<Camera>(*metres, "/c").focalLength, 3500);
    EXPECT_FLOAT_EQ(get<Camera>(*metres, "/c").focusDistance, 150);
}

TEST_F(UsdStage, CamerasWithoutAuthoredClippingOrFocusDoNeither) {
    const auto scene = read(
        "def Camera \"c\"\n{\nfloat fStop = 4\n}\ndef Camera \"flat\"\n{\ntoken projection = \"orthographic\"\n}\n" +
        square("m"));
    EXPECT_EQ(get<Camera>(*scene, "/c").nearClip, 0);
    EXPECT_TRUE(std::isinf(get<Camera>(*scene, "/c").farClip));
    EXPECT_EQ(get<Camera>(*scene, "/c").fStop, 0);
    EXPECT_TRUE(warned("/flat: orthographic"));
}

TEST_F(UsdStage, LightsOfEveryKind) {
    const auto scene =
        read("def RectLight \"rect\"\n{\nfloat inputs:intensity = 3\nfloat inputs:exposure = 2\n"
             "color3f inputs:color = (1, 0.5, 0.25)\nfloat inputs:width = 4\nfloat inputs:height = 5\n}\n"
             "def DiskLight \"disk\"\n{\nfloat inputs:radius = 2\n}\n"
             "def SphereLight \"sphere\"\n{\nfloat inputs:radius = 3\n}\n"
             "def CylinderLight \"cylinder\"\n{\nfloat inputs:radius = 1\nfloat inputs:length = 7\n}\n"
             "def DistantLight \"sun\"\n{\nfloat inputs:angle = 0\nfloat inputs:intensity = 2\n}\n"
             "def DomeLight \"dome\" {}\n" +
             square("m"));
    const auto rect = get<Light>(*scene, "/rect");
    EXPECT_EQ(rect.kind, LightKind::Rect);
    EXPECT_EQ(rect.radiance, glm::vec3(12, 6, 3));
    EXPECT_EQ(rect.width, 4);
    EXPECT_EQ(rect.height, 5);
    EXPECT_EQ(get<Light>(*scene, "/disk").kind, LightKind::Disk);
    EXPECT_EQ(get<Light>(*scene, "/disk").radius, 2);
    EXPECT_EQ(get<Light>(*scene, "/sphere").kind, LightKind::Sphere);
    EXPECT_EQ(get<Light>(*scene, "/cylinder").length, 7);
    EXPECT_EQ(get<Light>(*scene, "/sun").kind, LightKind::Distant);
    EXPECT_EQ(get<Light>(*scene, "/sun").angle, 0);
    EXPECT_EQ(get<Light>(*scene, "/sun").radiance, glm::vec3(2));
    EXPECT_EQ(get<Light>(*scene, "/dome").kind, LightKind::Dome);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdStage, LightInputsOfOldStagesAndColorTemperature) {
    const auto scene = read("def RectLight \"old\"\n{\nfloat intensity = 3\nfloat width = 4\n}\n"
                            "def SphereLight \"warm\"\n{\nbool inputs:enableColorTemperature = 1\nfloat "
                            "inputs:colorTemperature = 2700\n}\n" +
                            square("m"));
    EXPECT_EQ(get<Light>(*scene, "/old").radiance, glm::vec3(3));
    EXPECT_EQ(get<Light>(*scene, "/old").width, 4);
    const glm::vec3 warm = get<Light>(*scene, "/warm").radiance;
    EXPECT_GT(warm.x, warm.y);
    EXPECT_GT(warm.y, warm.z);
    EXPECT_NEAR(glm::dot(warm, glm::vec3(0.2126f, 0.7152f, 0.0722f)), 1, 1e-3) << "luminance stays";
}

/// Division by area happens in the engine, in square metres; USD means the stage's units.
TEST_F(UsdStage, NormalizeIsInStageUnits) {
    const std::string light =
        "def RectLight \"l\"\n{\nfloat inputs:width = 100\nfloat inputs:height = 200\nbool inputs:normalize = 1\n}\n";
    const auto scene = read(light + square("m"), "metersPerUnit = 0.01");
    const auto l = get<Light>(*scene, "/l");
    EXPECT_TRUE(l.normalize);
    const double squareMetres = 1.0 * 2.0;
    EXPECT_NEAR(l.radiance.x / squareMetres, 1.0 / (100 * 200), 1e-9);
}

TEST_F(UsdStage, DomePoles) {
    const std::string domes = "def DomeLight \"old\" {}\ndef DomeLight_1 \"scene\" {}\n"
                              "def DomeLight_1 \"y\"\n{\nuniform token poleAxis = \"Y\"\n}\n";
    const auto poleOf = [](const Scene& scene, const char* path) {
        return glm::normalize(glm::dvec3(get<WorldTransform>(scene, path).worldFromLocal[1]));
    };
    const auto zUp = read(domes + square("m"), "upAxis = \"Z\"\nmetersPerUnit = 1");
    expectNear(poleOf(*zUp, "/old"), {0, 0, -1});
    expectNear(poleOf(*zUp, "/y"), {0, 0, -1});
    expectNear(poleOf(*zUp, "/scene"), {0, 1, 0});
    const auto yUp = read(domes + square("m"), "upAxis = \"Y\"\nmetersPerUnit = 1");
    for (const char* path : {"/old", "/y", "/scene"}) expectNear(poleOf(*yUp, path), {0, 1, 0});
}

TEST_F(UsdStage, LightTextures) {
    write("sky.exr", "x");
    const auto scene = read("def DomeLight \"dome\"\n{\nasset inputs:texture:file = @sky.exr@\n}\n"
                            "def RectLight \"lost\"\n{\nasset inputs:texture:file = @none.exr@\n}\n" +
                            square("m"));
    EXPECT_EQ(scene->texture(get<Light>(*scene, "/dome").texture).name, (folder_ / "sky.exr").string());
    EXPECT_EQ(get<Light>(*scene, "/lost").texture, TextureId::None);
    EXPECT_TRUE(warned("/lost: texture not found: none.exr")) << allWarnings();
}

TEST_F(UsdStage, UnsupportedLightFeaturesAreNamed) {
    const auto scene = read(
        "def SphereLight \"spot\" (prepend apiSchemas = [\"ShapingAPI\"])\n{\nfloat inputs:shaping:cone:angle = 30\n"
        "float inputs:diffuse = 0.5\nbool treatAsPoint = 1\n}\ndef PortalLight \"portal\" {}\n" +
        square("m"));
    EXPECT_TRUE(warned("/spot: the light's shaping:cone:angle is not supported"));
    EXPECT_TRUE(warned("/spot: the light's diffuse is not supported"));
    EXPECT_TRUE(warned("/spot: the light's treatAsPoint is not supported"));
    EXPECT_TRUE(warned("/portal: prims of type PortalLight are not supported"));
    EXPECT_EQ(warnings_.size(), 4u) << allWarnings();
}

TEST_F(UsdStage, MeshLightsGlow) {
    const std::string light = "def Mesh \"m\" (prepend apiSchemas = [\"MeshLightAPI\"])\n{\n" + std::string(kSquare) +
                              "float inputs:intensity = 6\ndouble3 xformOp:scale = (2, 3, 1)\n"
                              "uniform token[] xformOpOrder = [\"xformOp:scale\"]\n";
    auto scene = read(light + "}\n");
    EXPECT_EQ(materialOf(*scene, "/m").emission, glm::vec3(6));
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(0.18f));
    scene = read(light + "bool inputs:normalize = 1\n}\n");
    EXPECT_NEAR(materialOf(*scene, "/m").emission.x, 1, 1e-6) << "6 over 2 * 3";
    scene = read(light + "uniform token light:materialSyncMode = \"noMaterialResponse\"\n}\n");
    EXPECT_EQ(materialOf(*scene, "/m").baseColor, glm::vec3(0));
}

TEST_F(UsdStage, RenderSettings) {
    const std::string settings =
        "def Scope \"Render\"\n{\ndef RenderSettings \"a\"\n{\nrel camera = </c>\n"
        "uniform int2 resolution = (640, 360)\n}\ndef RenderSettings \"b\"\n{\nrel camera = </d>\n}\n}\n"
        "def Camera \"c\" {}\ndef Camera \"d\" {}\n";
    auto scene = read(settings + square("m"));
    EXPECT_EQ(scene->renderSettings.camera, "/c");
    EXPECT_EQ(scene->renderSettings.width, 640u);
    EXPECT_EQ(scene->renderSettings.height, 360u);
    scene = read(settings + square("m"), "renderSettingsPrimPath = \"/Render/b\"");
    EXPECT_EQ(scene->renderSettings.camera, "/d");
    EXPECT_EQ(scene->renderSettings.width, 0u) << "the schema's default resolution is nobody's wish";
}

TEST_F(UsdStage, UnsupportedPrimsAreNamedOnceWithTheirNumber) {
    const auto scene = read("def BasisCurves \"a\" {}\ndef BasisCurves \"b\" {}\ndef Points \"p\" {}\n" + square("m"));
    EXPECT_TRUE(warned("/a (and 1 more): prims of type BasisCurves are not supported"));
    EXPECT_TRUE(warned("/p: prims of type Points are not supported"));
    EXPECT_EQ(warnings_.size(), 2u) << allWarnings();
}

} // namespace
} // namespace trilume::usd
