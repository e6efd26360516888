// The registry without loading any library: manifests, techniques, files and their errors. tests/abi loads plugins.

#include "core/file.h"
#include "core/log.h"
#include "errors.h"
#include "plugin/registry.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace trilume {
namespace {

namespace fs = std::filesystem;
using test::errorOf;

constexpr const char* kTechniques = R"([
  {"name": "raytrace", "nodes": ["visibility", "raytrace"], "rank": 1},
  {"name": "pathtrace", "doc": "slow", "nodes": ["pathtrace"], "reference": true, "rank": 5,
   "defaults": {"pathtrace.nee": false, "pathtrace.maxDepth": 8, "pathtrace.sampler": "sobol"}}
])";

/// A home of its own for each test, and the warnings that it draws.
class RegistryTest : public testing::Test {
protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        home_ = fs::path(testing::TempDir()) / fmt::format("trilume_{}_{}", test->name(), ::getpid());
        ::setenv("TRILUME_HOME", home_.c_str(), 1);
        ::unsetenv("TRILUME_PLUGIN_PATH");
        write("share/trilume/techniques.json", kTechniques);
        log::setSink([this](log::Level, std::string_view text) { warnings_.emplace_back(text); });
    }
    void TearDown() override {
        log::setSink({});
        fs::remove_all(home_);
    }

    fs::path write(const fs::path& path, std::string_view text) {
        fs::create_directories((home_ / path).parent_path());
        std::ofstream(home_ / path) << text;
        return home_ / path;
    }
    void plugin(const std::string& name, std::string_view keys, const std::string& folder = "lib/trilume/plugins") {
        write(fs::path(folder) / name / "plugin.json",
              fmt::format(R"({{"name": "{0}", "library": "{0}.so"{1}}})", name, keys));
    }
    bool warned(std::string_view part) const {
        for (const std::string& w : warnings_)
            if (w.find(part) != std::string::npos) return true;
        return false;
    }
    static void expectError(const Error& error, Fault fault, std::string_view what, std::string_view where,
                            std::string_view hint) {
        EXPECT_EQ(error.fault(), fault) << error.what();
        EXPECT_NE(error.problem().find(what), std::string::npos) << error.what();
        EXPECT_NE(error.where().find(where), std::string::npos) << error.what();
        EXPECT_NE(error.hint().find(hint), std::string::npos) << error.what();
    }

    fs::path home_;
    std::vector<std::string> warnings_;
};

// ---- techniques ----

TEST_F(RegistryTest, ReadsTechniques) {
    Registry registry;
    ASSERT_EQ(registry.techniques().size(), 2u);
    const Technique& t = registry.technique("pathtrace");
    EXPECT_EQ(t.doc, "slow");
    EXPECT_EQ(t.nodes, std::vector<std::string>{"pathtrace"});
    EXPECT_TRUE(t.reference);
    const std::vector<std::pair<std::string, std::string>> defaults{
        {"pathtrace.maxDepth", "8"}, {"pathtrace.nee", "false"}, {"pathtrace.sampler", "sobol"}};
    EXPECT_EQ(t.defaults, defaults);
    EXPECT_FALSE(registry.technique("raytrace").reference);
    EXPECT_EQ(registry.defaultTechnique().name, "pathtrace");
    EXPECT_TRUE(warnings_.empty());
}

TEST_F(RegistryTest, AnUnknownTechniqueListsTheKnownAndTheNearest) {
    Registry registry;
    expectError(errorOf([&] { registry.technique("pathrace"); }), Fault::Input, "unknown technique", "pathrace",
                "did you mean pathtrace? known are pathtrace, raytrace");
}

TEST_F(RegistryTest, TechniquesCanBeAddedAndReplaced) {
    Registry registry;
    const Technique& kept = registry.technique("raytrace");
    registry.addTechnique({.name = "mine", .nodes = {"a"}, .rank = 9});
    EXPECT_EQ(registry.defaultTechnique().name, "mine");
    registry.addTechnique({.name = "mine", .nodes = {"b"}, .rank = -1});
    EXPECT_EQ(registry.defaultTechnique().name, "pathtrace");
    EXPECT_EQ(registry.technique("mine").nodes, std::vector<std::string>{"b"});
    EXPECT_EQ(registry.techniques().size(), 3u);
    for (int i = 0; i < 100; ++i) registry.addTechnique({.name = fmt::format("t{}", i), .nodes = {"a"}});
    EXPECT_EQ(&registry.technique("raytrace"), &kept);
}

TEST_F(RegistryTest, BadTechniquesFilesAreNamed) {
    for (const char* text :
         {"", "[", "{}", "[1]", R"([{"nodes": ["a"]}])", R"([{"name": "a"}])", R"([{"name": "a", "nodes": "b"}])",
          R"([{"name": "a", "nodes": ["b"], "rank": "high"}])"}) {
        warnings_.clear();
        write("share/trilume/techniques.json", text);
        Registry registry;
        EXPECT_TRUE(warned("techniques.json")) << text;
        expectError(errorOf([&] { registry.defaultTechnique(); }), Fault::Run, "no techniques", "techniques.json",
                    "install");
    }
}

// ---- manifests ----

TEST_F(RegistryTest, FindsPluginsWithoutLoadingThem) {
    plugin("a", R"(, "version": "1.2", "description": "does a", "nodes": ["n"], "imageWriters": ["EXR", ".png"])");
    plugin("b", R"(, "sceneReaders": ["usda"], "textureReader": true, "techniques": [{"name": "t", "nodes": ["n"]}])",
           "more");
    ::setenv("TRILUME_PLUGIN_PATH", (":/no/such/folder:" + (home_ / "more").string()).c_str(), 1);
    Registry registry;
    const auto infos = registry.plugins();
    ASSERT_EQ(infos.size(), 2u);
    EXPECT_EQ(infos[0].name, "a");
    EXPECT_EQ(infos[0].version, "1.2");
    EXPECT_EQ(infos[0].description, "does a");
    EXPECT_EQ(infos[0].nodes, std::vector<std::string>{"n"});
    EXPECT_EQ(infos[0].imageExtensions, (std::vector<std::string>{".exr", ".png"}));
    EXPECT_EQ(infos[1].sceneExtensions, std::vector<std::string>{".usda"});
    EXPECT_TRUE(infos[1].textures);
    EXPECT_FALSE(infos[0].loaded || infos[1].loaded);
    EXPECT_EQ(registry.technique("t").nodes, std::vector<std::string>{"n"});
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_TRUE(warned("/no/such/folder"));
    EXPECT_TRUE(registry.canWriteImage("x.EXR"));
    EXPECT_TRUE(registry.canWriteImage("x.pfm"));
    EXPECT_FALSE(registry.canWriteImage("x.gif"));
    EXPECT_FALSE(registry.canWriteImage("x"));
}

TEST_F(RegistryTest, BadManifestsAreNamedAndSkipped) {
    const std::vector<std::string> bad{"",
                                       "{",
                                       "[]",
                                       R"({"library": "x.so"})",
                                       R"({"name": "", "library": "x.so"})",
                                       R"({"name": "x"})",
                                       R"({"name": 1, "library": "x.so"})",
                                       R"({"name": "x", "library": "x.so", "nodes": "one"})",
                                       R"({"name": "x", "library": "x.so", "nodes": [1]})",
                                       R"({"name": "x", "library": "x.so", "textureReader": "yes"})",
                                       R"({"name": "x", "library": "x.so", "techniques": {}})"};
    plugin("z", "");
    for (const std::string& text : bad) {
        warnings_.clear();
        const fs::path file = write("lib/trilume/plugins/bad/plugin.json", text);
        Registry registry;
        ASSERT_EQ(registry.plugins().size(), 1u) << text;
        ASSERT_EQ(warnings_.size(), 1u) << text;
        EXPECT_TRUE(warned(file.string())) << warnings_[0];
        EXPECT_EQ(warnings_[0].find('\n'), std::string::npos);
        const Error e = errorOf([&] { registry.loadPlugin(file.parent_path()); });
        EXPECT_EQ(e.fault(), Fault::Input);
        EXPECT_NE(std::string(e.what()).find(file.string()), std::string::npos) << e.what();
    }
}

TEST_F(RegistryTest, TheFirstPluginOfANameServes) {
    plugin("same", R"(, "version": "1")");
    plugin("same", R"(, "version": "2")", "more");
    ::setenv("TRILUME_PLUGIN_PATH", (home_ / "more").c_str(), 1);
    Registry registry;
    ASSERT_EQ(registry.plugins().size(), 1u);
    EXPECT_EQ(registry.plugins()[0].version, "1");
    EXPECT_TRUE(warned("plugin same in " + (home_ / "more/same").string() + " ignored"));
    expectError(errorOf([&] { registry.loadPlugin(home_ / "more/same"); }), Fault::Input,
                "another plugin same is known", "more/same", "came first");
}

TEST_F(RegistryTest, AMissingLibraryDeclinesWithTheReason) {
    plugin("a", R"(, "nodes": ["n"], "imageWriters": ["exr"], "textureReader": true)");
    Registry registry;
    expectError(errorOf([&] { registry.node("n"); }), Fault::Input, "the plugin a for node n was declined", "plugins/a",
                "library is missing");
    EXPECT_NE(registry.plugins()[0].declined.find("a.so"), std::string::npos);
    EXPECT_FALSE(registry.plugins()[0].loaded);
    EXPECT_FALSE(registry.canWriteImage("x.exr")) << "known by now";
    expectError(errorOf([&] {
                    registry.writeImage("x.exr", {1, 1, 3, {0, 0, 0}});
                }),
                Fault::Input, "declined", "plugins/a", "library is missing");
    expectError(errorOf([&] { registry.readTexture(home_ / "share/trilume/techniques.json", ColorSpace::Auto); }),
                Fault::Input, "declined", "plugins/a", "library is missing");
}

TEST_F(RegistryTest, AFileThatIsNoLibraryDeclinesWithTheReason) {
    plugin("a", R"(, "nodes": ["n"])");
    write("lib/trilume/plugins/a/a.so", "not a library");
    Registry registry;
    expectError(errorOf([&] { registry.loadPlugin(home_ / "lib/trilume/plugins/a"); }), Fault::Input, "declined",
                "plugins/a", "does not load");
}

TEST_F(RegistryTest, AnUnknownNodeListsTheKnownAndTheNearest) {
    plugin("a", R"(, "nodes": ["visibility", "raytrace"])");
    Registry registry;
    registry.addNode({"composite", "application", [] { return nullptr; }});
    expectError(errorOf([&] { registry.node("raytrase"); }), Fault::Input, "unknown node", "raytrase",
                "did you mean raytrace? known are composite, raytrace, visibility");
}

// ---- what the application adds itself ----

TEST_F(RegistryTest, WhatIsOfferedTwiceIsServedByTheFirst) {
    Registry registry;
    registry.addNode({"n", "first", nullptr});
    registry.addNode({"n", "second", nullptr});
    EXPECT_EQ(registry.node("n").plugin, "first");
    registry.addParam({.name = "n.x", .defaultValue = 1.0, .maximum = 2});
    registry.addParam({.name = "n.x", .defaultValue = 2.0, .maximum = 2});
    EXPECT_EQ(std::get<double>(registry.params().find("n.x")->defaultValue), 1.0);
    EXPECT_EQ(warnings_.size(), 2u);
    EXPECT_THROW(registry.addParam({.name = "n.y", .defaultValue = 3.0, .maximum = 2}), Error);
    EXPECT_EQ(registry.params().find("n.y"), nullptr);
}

// ---- files ----

TEST_F(RegistryTest, ScenesAreReadByExtensionWhateverItsCase) {
    Registry registry;
    registry.addSceneReader({"toy", ".TOY2"}, [](const fs::path&) { return std::make_unique<Scene>(); });
    const fs::path file = write("a.ToY", "x");
    EXPECT_EQ(registry.readScene(file)->path, file.string());
    EXPECT_NO_THROW(registry.readScene(write("a.toy2", "x")));
}

TEST_F(RegistryTest, ScenesThatCantBeRead) {
    plugin("usd", R"(, "sceneReaders": ["usda", "usdc"])");
    Registry registry;
    const auto read = [&](const fs::path& path) { return errorOf([&] { registry.readScene(path); }); };
    expectError(read(home_ / "none.usda"), Fault::Input, "no such file", "none.usda", "check the path");
    expectError(read(home_), Fault::Input, "not a file", home_.string(), "folder");
    expectError(read(write("empty.usda", "")), Fault::Input, "the file is empty", "empty.usda", "");
    expectError(read(write("a.obj", "x")), Fault::Input, "nothing reads scenes of this kind", "a.obj",
                "known are .tlscene, .usda, .usdc");
    expectError(read(write("plain", "x")), Fault::Input, "nothing reads scenes of this kind", "plain", "known are");
    EXPECT_TRUE(registry.plugins()[0].declined.empty()) << "nothing was loaded for these";

    registry.addSceneReader({"bad"},
                            [](const fs::path&) -> std::unique_ptr<Scene> { throw std::runtime_error("oops"); });
    expectError(read(write("a.bad", "x")), Fault::Input, "cannot read the scene", "a.bad", "oops");
    registry.addSceneReader({"null"}, [](const fs::path&) -> std::unique_ptr<Scene> { return nullptr; });
    expectError(read(write("a.null", "x")), Fault::Run, "returned nothing", "a.null", "");
}

TEST_F(RegistryTest, WritesPfmWithoutPlugins) {
    Registry registry;
    const auto floats = [&](const ImageData& image) {
        registry.writeImage(home_ / "x.PFM", image);
        const std::string text = readTextFile(home_ / "x.PFM");
        std::vector<float> values(3 * image.width * image.height);
        std::memcpy(values.data(), text.data() + text.size() - 4 * values.size(), 4 * values.size());
        return values;
    };
    EXPECT_EQ(floats({2, 1, 3, {1, 2, 3, 4, 5, 6}}), (std::vector<float>{1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(floats({2, 1, 1, {1, 2}}), (std::vector<float>{1, 1, 1, 2, 2, 2}));
    EXPECT_EQ(floats({1, 1, 2, {1, 2}}), (std::vector<float>{1, 2, 0}));
    EXPECT_EQ(floats({1, 1, 4, {1, 2, 3, 4}}), (std::vector<float>{1, 2, 3}));
    expectError(errorOf([&] {
                    registry.writeImage(home_ / "x.pfm", {2, 2, 3, {1}});
                }),
                Fault::Run, "has 1 values", "x.pfm", "");
}

TEST_F(RegistryTest, ImageFiltersByName) {
    plugin("a", R"(, "imageFilters": ["smooth"])");
    Registry registry;
    EXPECT_EQ(registry.plugins()[0].imageFilters, std::vector<std::string>{"smooth"});
    expectError(errorOf([&] { registry.imageFilter("smoth"); }), Fault::Input, "unknown image filter", "smoth",
                "did you mean smooth?");
    registry.addImageFilter("double", [] {
        return [](ImageData& picture, const ImageData&, const ImageData&) {
            for (float& x : picture.pixels) x *= 2;
        };
    });
    ImageData picture{1, 1, 1, {3}};
    registry.imageFilter("double")(picture, {}, {});
    EXPECT_EQ(picture.pixels[0], 6);
}

TEST_F(RegistryTest, ImagesOfUnknownKind) {
    plugin("io", R"(, "imageWriters": ["exr"])");
    Registry registry;
    expectError(errorOf([&] {
                    registry.writeImage("x.gif", {1, 1, 3, {0, 0, 0}});
                }),
                Fault::Input, "nothing writes images of this kind", "x.gif", "known are .exr, .pfm");
    std::string written;
    registry.addImageWriter({"toy"}, [&](const fs::path& p, const ImageData&) { written = p.string(); });
    registry.writeImage("a.TOY", {1, 1, 3, {0, 0, 0}});
    EXPECT_EQ(written, "a.TOY");
    EXPECT_TRUE(registry.canWriteImage("b.toy"));
}

TEST_F(RegistryTest, Textures) {
    Registry registry;
    const fs::path file = write("wood.png", "x");
    expectError(errorOf([&] { registry.readTexture(file, ColorSpace::Srgb); }), Fault::Input,
                "no plugin reads textures", "wood.png", "image_io");
    registry.addTextureReader([](const fs::path& p, ColorSpace) { return Texture{.name = p.filename()}; });
    EXPECT_EQ(registry.readTexture(file, ColorSpace::Srgb).name, "wood.png");
    expectError(errorOf([&] { registry.readTexture(home_ / "none.png", ColorSpace::Srgb); }), Fault::Input,
                "no such file", "none.png", "");
}

} // namespace
} // namespace trilume
