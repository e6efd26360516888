#include "reader/python.h"
#include "usd_stage_fixture.h"

#include <csignal>
#include <random>

// Bad input: an error or a warning of one line, never a crash, never a silent black image.
namespace trilume::usd {
namespace {

class UsdBadInput : public UsdStage {
protected:
    /// The error's parts are one line each and it is an input error that names the file.
    void expectError(const std::filesystem::path& path, std::string_view part) {
        try {
            readFile(path);
            ADD_FAILURE() << path << " was read";
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::Input);
            EXPECT_NE(e.where().find(path.filename().string()), std::string::npos);
            EXPECT_NE(e.problem().find(part), std::string::npos) << e.problem();
            EXPECT_FALSE(e.hint().empty());
            for (const std::string& text : {e.problem(), e.where(), e.hint()})
                EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        }
    }
};

TEST_F(UsdBadInput, FilesThatAreNoStages) {
    expectError(folder_ / "missing.usda", "not a readable USD stage");
    expectError(write("text.usda", "hello\nthis is text\n"), "not a valid usda layer");
    expectError(write("empty.usda", ""), "not a readable USD stage");
    expectError(write("empty.usdc", ""), "not a readable USD stage");
    expectError(write("junk.usdc", std::string(1000, 'x')), "not a readable USD stage");
    expectError(write("junk.usdz", "PK\3\4abc"), "not a readable USD stage");
    expectError(write("syntax.usda", "#usda 1.0\ndef Mesh \"a\"\n{\n point3f[] points = [(1, 2,\n}\n"), "syntax.usda:");
    std::filesystem::create_directories(folder_ / "directory.usda");
    expectError(folder_ / "directory.usda", "not a readable USD stage");
}

/// Every prefix of a binary stage is an error, or a picture of what is there.
TEST_F(UsdBadInput, TruncatedBinaryStages) {
    const auto text = write("full.usda", "#usda 1.0\n" + square("m") + "def SphereLight \"l\" {}\n");
    {
        ensurePython();
        py::gil_scoped_acquire lock;
        importReader();
        const py::object stage = py::module_::import("pxr.Usd").attr("Stage").attr("Open")(text.string());
        stage.attr("Export")((folder_ / "full.usdc").string());
    }
    std::ifstream in(folder_ / "full.usdc", std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    ASSERT_GT(bytes.size(), 500u);
    for (size_t size : {size_t{10}, size_t{88}, bytes.size() / 4, bytes.size() / 2, bytes.size() - 1}) {
        const auto path = write("cut" + std::to_string(size) + ".usdc", std::string_view(bytes).substr(0, size));
        expectError(path, "not a readable USD stage");
    }
}

TEST_F(UsdBadInput, NothingToSee) {
    expectError(write("none.usda", "#usda 1.0\n"), "no geometry");
    expectError(write("xform.usda", "#usda 1.0\ndef Xform \"a\" {}\ndef Camera \"c\" {}\n"), "no geometry");
    expectError(write("sun.usda", "#usda 1.0\ndef DistantLight \"a\" {}\n"), "no geometry");
    expectError(write("proxy.usda", "#usda 1.0\ndef Sphere \"a\"\n{\nuniform token purpose = \"proxy\"\n}\n"),
                "no geometry");
    expectError(write("hidden.usda", "#usda 1.0\ndef Sphere \"a\"\n{\ntoken visibility = \"invisible\"\n}\n"),
                "no geometry");
    expectError(write("mesh.usda", "#usda 1.0\ndef Mesh \"a\" {}\n"), "no geometry");
    EXPECT_TRUE(warned("/a: the mesh has no usable face"));
}

TEST_F(UsdBadInput, LightsAloneAreAPicture) {
    read("def DomeLight \"d\" {}\n");
    EXPECT_TRUE(warned("lights but no geometry"));
}

TEST_F(UsdBadInput, ReferencesThatDoNotResolve) {
    write("text.usda", "no stage");
    const auto scene = read(
        "def \"a\" (prepend references = @nope.usda@</x>)\n{\n}\ndef \"b\" (prepend references = </missing>)\n{\n}\n" +
            square("m"),
        "subLayers = [@lost.usda@, @text.usda@]");
    EXPECT_EQ(scene->world.count<MeshInstance>(), 1u);
    EXPECT_TRUE(warned("nope.usda"));
    EXPECT_TRUE(warned("/b: "));
    EXPECT_TRUE(warned("lost.usda"));
    EXPECT_TRUE(warned("text.usda"));
    EXPECT_EQ(warnings_.size(), 4u) << allWarnings();
    for (const std::string& line : warnings_) EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST_F(UsdBadInput, MeshesLoseOnlyWhatIsBad) {
    const auto mesh = [](std::string_view name, std::string_view counts, std::string_view indices,
                         std::string_view point) {
        return "def Mesh \"" + std::string(name) + "\"\n{\npoint3f[] points = [" + std::string(point) +
               ", (1, 0, 0), (1, 1, 0), (0, 1, 0)]\n" + "int[] faceVertexCounts = [" + std::string(counts) +
               "]\nint[] faceVertexIndices = [" + std::string(indices) + "]\n}\n";
    };
    const auto scene = read(
        mesh("nan", "3, 3", "0, 1, 2, 1, 2, 3", "(nan, 0, 0)") +
        mesh("infinite", "3, 3", "0, 1, 2, 1, 2, 3", "(0, -inf, 0)") +
        mesh("range", "3, 3", "0, 1, 99, 1, 2, 3", "(0, 0, 0)") +
        mesh("negative", "3, 3", "0, 1, -9, 1, 2, 3", "(0, 0, 0)") + mesh("sum", "3, 9", "1, 2, 3, 0", "(0, 0, 0)") +
        mesh("area", "3, 3", "0, 0, 0, 1, 2, 3", "(0, 0, 0)") + mesh("lost", "3", "0, 1, 99", "(0, 0, 0)"));
    EXPECT_EQ(scene->world.count<MeshInstance>(), 6u);
    for (const char* name : {"/nan", "/infinite", "/range", "/negative", "/sum", "/area"}) {
        EXPECT_EQ(meshOf(*scene, name).triangles.size(), 1u) << name;
        EXPECT_TRUE(warned(std::string(name) + ": ")) << name;
    }
    EXPECT_TRUE(warned("/lost: the mesh has no usable face"));
    EXPECT_FALSE(scene->bounds().empty());
    EXPECT_LT(scene->bounds().radius(), 2);
}

TEST_F(UsdBadInput, ShapesWithoutExtentAreNamed) {
    const char* const shapes[][2] = {{"Sphere", "radius = 0"},     {"Sphere", "radius = nan"}, {"Cube", "size = -1"},
                                     {"Cylinder", "height = inf"}, {"Cone", "radius = 0"},     {"Plane", "width = 0"},
                                     {"Capsule", "radius = -2"}};
    std::string prims = "def SphereLight \"l\" {}\n";
    for (size_t i = 0; i < std::size(shapes); ++i)
        prims += fmt::format("def {} \"s{}\"\n{{\ndouble {}\n}}\n", shapes[i][0], i, shapes[i][1]);
    auto scene = read(prims);
    EXPECT_EQ(scene->world.count<MeshInstance>() + scene->world.count<SphereInstance>(), 0u);
    EXPECT_TRUE(warned("/s0 (and 3 more): its radius is not a positive number")) << allWarnings();
    EXPECT_TRUE(warned("/s2: its size is not")) << allWarnings();
    EXPECT_TRUE(warned("/s3: its height is not")) << allWarnings();
    EXPECT_TRUE(warned("/s5: its width is not")) << allWarnings();
    EXPECT_TRUE(warned("lights but no geometry"));
    warnings_.clear();
    scene = read("def Capsule \"ball\"\n{\ndouble height = 0\n}\n"
                 "def Cylinder_1 \"cone\"\n{\ndouble radiusTop = 0\n}\n");
    EXPECT_EQ(scene->world.count<MeshInstance>(), 2u);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdBadInput, PrimvarsOfWrongSize) {
    const auto scene =
        read(square("m", "texCoord2f[] primvars:st = [(0, 0)] (interpolation = \"vertex\")\n"
                         "normal3f[] normals = [(0, 0, 1), (0, 0, 1)] (interpolation = \"faceVarying\")\n"));
    EXPECT_TRUE(meshOf(*scene, "/m").uvs.empty());
    EXPECT_TRUE(warned("/m: texture coordinates do not match"));
    EXPECT_TRUE(warned("/m: normals do not match"));
}

TEST_F(UsdBadInput, TransformsThatAreNone) {
    const auto scene = read("def Xform \"flat\"\n{\ndouble3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = "
                            "[\"xformOp:scale\"]\n" +
                            square("m") +
                            "}\n"
                            "def Sphere \"lost\"\n{\ndouble3 xformOp:translate = (nan, 0, 0)\nuniform token[] "
                            "xformOpOrder = [\"xformOp:translate\"]\n}\n"
                            "def Sphere \"odd\"\n{\nuniform token[] xformOpOrder = [\"xformOp:nonsense\"]\n}\n" +
                            square("m"));
    EXPECT_EQ(scene->world.count<MeshInstance>(), 1u);
    EXPECT_TRUE(warned("/flat/m: its transform is singular"));
    EXPECT_TRUE(warned("/lost: its transform is singular or not finite"));
    EXPECT_TRUE(warned("/odd")) << allWarnings();
}

TEST_F(UsdBadInput, TinyAndHugeScalesAreNotSingular) {
    const auto scene = read("def Sphere \"s\"\n{\ndouble3 xformOp:scale = (1e-9, 1e-9, 1e-9)\nuniform token[] "
                            "xformOpOrder = [\"xformOp:scale\"]\n}\n"
                            "def Sphere \"b\"\n{\ndouble3 xformOp:scale = (1e9, 1e9, 1e9)\nuniform token[] "
                            "xformOpOrder = [\"xformOp:scale\"]\n}\n");
    EXPECT_EQ(scene->world.count<SphereInstance>(), 2u);
    EXPECT_EQ(allWarnings(), "");
}

TEST_F(UsdBadInput, LightsAndCamerasWithBadNumbers) {
    const auto scene = read("def RectLight \"l\"\n{\nfloat inputs:intensity = nan\n}\ndef SphereLight \"s\"\n{\nfloat "
                            "inputs:radius = 0\n}\n"
                            "def Camera \"c\"\n{\nfloat focalLength = 0\nfloat horizontalAperture = nan\n}\n" +
                            square("m"));
    EXPECT_EQ(get<Light>(*scene, "/l").radiance, glm::vec3(0));
    EXPECT_TRUE(warned("/l: emission is negative or not finite"));
    EXPECT_TRUE(warned("/s: the light's radius is not a positive number"));
    EXPECT_GT(get<Camera>(*scene, "/c").focalLength, 0);
    EXPECT_GT(get<Camera>(*scene, "/c").horizontalAperture, 0);
}

TEST_F(UsdBadInput, PointInstancersWithBadArrays) {
    const auto instancer = [](std::string_view name, std::string_view indices, std::string_view positions,
                              std::string_view prototypes) {
        return "def PointInstancer \"" + std::string(name) + "\"\n{\nrel prototypes = " + std::string(prototypes) +
               "\nint[] protoIndices = " + std::string(indices) + "\npoint3f[] positions = " + std::string(positions) +
               "\n}\n";
    };
    const auto scene =
        read("def Sphere \"ball\" {}\n" + instancer("range", "[0, 7, -1]", "[(0,0,0),(1,0,0),(2,0,0)]", "</ball>") +
             instancer("length", "[0, 0]", "[(0,0,0)]", "</ball>") +
             instancer("none", "[0]", "[(0,0,0)]", "</missing>") + instancer("self", "[0]", "[(0,0,0)]", "</self>") +
             instancer("place", "[0, 0]", "[(nan,0,0),(1,0,0)]", "</ball>"));
    EXPECT_EQ(scene->world.count<SphereInstance>(), 3u) << "the prototype itself, one of three, one of two";
    EXPECT_TRUE(warned("/range (and 1 more): instances name no prototype that exists")) << allWarnings();
    EXPECT_TRUE(warned("/self: a point instancer that contains itself")) << allWarnings();
    EXPECT_TRUE(warned("found [1] positions, but expected [2]")) << "what USD itself says";
    for (const char* name : {"/length", "/place[0]"}) EXPECT_TRUE(warned(name)) << name << "\n" << allWarnings();
}

TEST_F(UsdBadInput, MoreCopiesThanAnyoneCanPlace) {
    std::string list = "0", points = "(0, 0, 0)", prims = "def Sphere \"ball\" {}\n";
    for (int i = 1; i < 300; ++i) {
        list += ", 0";
        points += ", (" + std::to_string(i) + ", 0, 0)";
    }
    const char* const prototypes[] = {"/ball", "/a", "/b"};
    for (int i = 0; i < 3; ++i)
        prims += "def PointInstancer \"" + std::string(1, static_cast<char>('a' + i)) + "\"\n{\nrel prototypes = <" +
                 prototypes[i] + ">\nint[] protoIndices = [" + list + "]\npoint3f[] positions = [" + points + "]\n}\n";
    expectError(write("many.usda", "#usda 1.0\n" + prims), "27090301 copies of prims, most of them of /ball");
}

TEST_F(UsdBadInput, UnitsThatAreNone) {
    const auto scene = read(square("m"), "metersPerUnit = 0");
    EXPECT_TRUE(warned("metersPerUnit"));
    expectNear(position(*scene, "/m", {1, 0, 0}), {0.01, 0, 0});
}

TEST_F(UsdBadInput, InterruptsStayTheApplications) {
    read(square("m"));
    struct sigaction action {};
    sigaction(SIGINT, nullptr, &action);
    EXPECT_EQ(action.sa_handler, SIG_DFL);
}

TEST_F(UsdBadInput, NothingIsPrintedByUsd) {
    ::testing::internal::CaptureStderr();
    read("def \"a\" (prepend references = @nope.usda@</x>)\n{\n}\n" + square("m"));
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

} // namespace
} // namespace trilume::usd
