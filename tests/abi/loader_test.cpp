// Plugins as shared libraries: one that serves, and one for each way of being declined.

#include "core/error.h"
#include "core/log.h"
#include "graph/compile.h"
#include "plugin/registry.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace trilume {
namespace {

namespace fs = std::filesystem;

const fs::path kPlugins = TL_ABI_PLUGINS;

class LoaderTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::path(testing::TempDir()) / fmt::format("trilume_loader_{}", ::getpid());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path write(const std::string& name, std::string_view text) {
        std::ofstream(folder_ / name) << text;
        return folder_ / name;
    }
    static Registry::PluginInfo info(const Registry& registry, std::string_view name) {
        for (Registry::PluginInfo& i : registry.plugins())
            if (i.name == name) return i;
        throw std::logic_error("no such plugin");
    }
    /// What loading says, in one line; empty when it succeeds.
    static std::string load(Registry& registry, const fs::path& directory) {
        try {
            registry.loadPlugin(directory);
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::Input);
            return e.what();
        }
        return {};
    }

    fs::path folder_;
};

TEST_F(LoaderTest, AGoodPluginIsLoadedWhenFirstAskedFor) {
    // A path with the toy alone: the others share one name.
    fs::create_directory_symlink(kPlugins / "toy", folder_ / "toy");
    ::setenv("TRILUME_PLUGIN_PATH", folder_.c_str(), 1);
    Registry registry;
    ::unsetenv("TRILUME_PLUGIN_PATH");
    EXPECT_FALSE(info(registry, "toy").loaded);
    EXPECT_EQ(registry.technique("toy").nodes, std::vector<std::string>{"toy"});
    EXPECT_FALSE(info(registry, "toy").loaded);
    EXPECT_EQ(registry.params().find("toy.size"), nullptr);

    const std::unique_ptr<graph::Node> node = registry.node("toy").create();
    EXPECT_TRUE(info(registry, "toy").loaded);
    EXPECT_EQ(registry.node("toy").plugin, "toy");
    const graph::GraphNode nodes[]{{.name = "toy", .node = node.get()}};
    const std::string outputs[]{"toy.color"};
    const ParamSet params(registry.params());
    const graph::SceneFacts facts;
    EXPECT_EQ(graph::compile({nodes, facts, params, 4, 4, outputs}).find("toy.color")->bytes, 4u * 4 * 3);
}

TEST_F(LoaderTest, ReadersAndWritersCrossTheBorder) {
    Registry registry;
    ASSERT_EQ(load(registry, kPlugins / "toy"), "");
    EXPECT_EQ(load(registry, kPlugins / "toy"), "") << "twice is once";
    EXPECT_NE(registry.readScene(write("good.toy", "fine")), nullptr);
    try {
        registry.readScene(write("bad.toy", "broken"));
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.problem(), "a broken toy");
    }
    EXPECT_EQ(registry.readTexture(folder_ / "good.toy", ColorSpace::Srgb).rgba8.size(), 4u);
    registry.writeImage(folder_ / "x.toyimage", {2, 1, 1, {0, 0}});
    std::string text;
    std::getline(std::ifstream(folder_ / "x.toyimage"), text);
    EXPECT_EQ(text, "2 x 1");
}

TEST_F(LoaderTest, EachRegistryIsServed) {
    Registry first, second;
    ASSERT_EQ(load(first, kPlugins / "toy"), "");
    ASSERT_EQ(load(second, kPlugins / "toy"), "");
    EXPECT_NE(first.node("toy").create(), nullptr);
    EXPECT_NE(second.node("toy").create(), nullptr);
}

TEST_F(LoaderTest, EachFaultIsDeclinedWithItsReason) {
    const std::pair<const char*, const char*> faults[]{
        {"size", "TlPluginInfo has"},
        {"abi", "plugin ABI 3, the engine's is 2"},
        {"tag", "built as \"0.0.1 another compiler\""},
        {"name", "the library says that it is \"another\", plugin.json that it is \"broken\""},
        {"query", "the library lacks tlPluginQuery"},
        {"info", "tlPluginQuery returned null"},
        {"register", "the library lacks tlPluginRegister"},
        {"symbol", "definedNowhere"},
        {"param", "default out of its own range: broken.y"},
        {"node", "plugin.json lists the node broken, which the plugin does not register"},
        {"throw", "no licence found"},
        {"refusal", "no camera attached"},
        {"result", "tlPluginRegister returned 7"},
        {"c99", "built as \"\""},
    };
    for (const auto& [folder, reason] : faults) {
        SCOPED_TRACE(folder);
        Registry registry;
        const std::string said = load(registry, kPlugins / folder);
        EXPECT_NE(said.find("was declined"), std::string::npos) << said;
        EXPECT_NE(said.find(reason), std::string::npos) << said;
        EXPECT_EQ(said.find('\n'), std::string::npos) << said;
        const std::string name = folder == std::string_view("c99") ? "c99" : "broken";
        EXPECT_FALSE(info(registry, name).loaded);
        EXPECT_NE(info(registry, name).declined.find(reason), std::string::npos);
        EXPECT_EQ(registry.params().rows().size(), 0u) << "nothing of a declined plugin stays";
        EXPECT_THROW(registry.node("broken"), Error);
    }
}

TEST_F(LoaderTest, ADeclinedPluginCanBeReplacedAndLoaded) {
    Registry registry;
    const fs::path plugin = folder_ / "plugin";
    fs::create_directories(plugin);
    std::ofstream(plugin / "plugin.json") << R"({"name": "toy", "library": "toy.so", "nodes": ["toy"]})";
    fs::copy(kPlugins / "abi" / "broken.so", plugin / "toy.so");
    EXPECT_NE(load(registry, plugin), "");
    EXPECT_THROW(registry.node("toy"), Error);
    fs::remove(plugin / "toy.so");
    fs::copy(kPlugins / "toy" / "toy.so", plugin / "toy.so");
    EXPECT_EQ(load(registry, plugin), "");
    EXPECT_NE(registry.node("toy").create(), nullptr);
    EXPECT_TRUE(info(registry, "toy").declined.empty());
}

} // namespace
} // namespace trilume
