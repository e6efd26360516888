// Compiling shaders, and the caches of SPIR-V and pipelines on disk. Whatever makes a device here runs in a process of
// its own, so that caches are met cold and the processes can run at once.
#include "gpu/cache_file.h"
#include "gpu/device.h"
#include "gpu/shader_compiler.h"

#include "core/file.h"
#include "errors.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <sys/wait.h>
#include <unistd.h>

using namespace trilume;
namespace fs = std::filesystem;

namespace {

const gpu::ShaderSource kTriple{.path = "triple", .text = R"(#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.h"
layout(local_size_x = 32) in;
layout(constant_id = 0) const uint kFactor = 3;
layout(push_constant, scalar) uniform Push { uintRef result; } push;
void main() { push.result.v[gl_GlobalInvocationID.x] = kFactor * gl_GlobalInvocationID.x; }
)"};

bool multiplies(gpu::Device& device, const gpu::Pipeline& pipeline, uint32_t factor) {
    const auto out = device.createBuffer(1024 * 4, gpu::Memory::Device, "result");
    device.wait(device.submit([&](gpu::Commands& c) { c.dispatch(pipeline, out.address(), 1024); }));
    std::vector<uint32_t> result(1024);
    device.download(out, 0, std::as_writable_bytes(std::span(result)));
    for (uint32_t i = 0; i < result.size(); ++i)
        if (result[i] != factor * i) return false;
    return true;
}

bool tripleWorks() {
    gpu::Device device({.device = "auto", .validation = true});
    return multiplies(device, device.createPipeline(kTriple), 3) && device.validationMessages() == 0;
}

/// Without validation, with which software devices keep shaders rather than pipelines.
bool triplesAndQuadruples() {
    gpu::Device device({.device = "auto", .validation = false});
    gpu::ShaderSource quadruple = kTriple;
    quadruple.specialization = {4};
    const gpu::ShaderSource sources[] = {kTriple, quadruple};
    const auto pipelines = device.createPipelines(sources);
    return multiplies(device, pipelines[0], 3) && multiplies(device, pipelines[1], 4);
}

class ShaderTest : public testing::Test {
protected:
    void SetUp() override {
        cache_ = fs::temp_directory_path() /
                 ("trilume_shader_test." + std::to_string(getpid()) + "." + std::to_string(serial_++));
        fs::create_directories(cache_);
        setenv("XDG_CACHE_HOME", cache_.c_str(), 1);
    }
    void TearDown() override { fs::remove_all(cache_); }

    static pid_t start(const std::function<bool()>& body) {
        const pid_t child = fork();
        if (child != 0) return child;
        bool good = false;
        try {
            good = body();
        } catch (const std::exception& error) {
            std::fprintf(stderr, "child: %s\n", error.what());
        }
        _exit(good ? 0 : 1);
    }
    static bool succeeded(pid_t child) {
        int status = 1;
        return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    }

    std::vector<fs::path> filesIn(const char* folder) const {
        std::vector<fs::path> files;
        if (fs::exists(cache_ / "trilume" / folder))
            for (const auto& entry : fs::directory_iterator(cache_ / "trilume" / folder)) files.push_back(entry);
        return files;
    }

    /// Runs `check` with each kind of damage done to the file.
    static void damage(const fs::path& file, const std::function<void(const char* how)>& check) {
        const auto original = readFile(file);
        const auto with = [&](const char* how, std::vector<std::byte> bytes) {
            writeFileAtomically(file, bytes);
            check(how);
            EXPECT_EQ(readFile(file), original) << how << ": not repaired";
        };
        auto flipped = original;
        flipped.back() ^= std::byte{1};
        auto grown = original;
        grown.resize(grown.size() + 4);
        with("empty", {});
        with("only a header's start", {original.begin(), original.begin() + 10});
        with("cut short", {original.begin(), original.end() - 8});
        with("one bit flipped", flipped);
        with("longer", grown);
        with("something else", std::vector<std::byte>(original.size(), std::byte{'x'}));
    }

    fs::path cache_;
    static inline int serial_ = 0;
};

Error errorOf(const gpu::ShaderSource& source) {
    return test::errorOf([&] { gpu::compileShader(source); });
}

// ---- Compiling -------------------------------------------------------------------------------------

TEST_F(ShaderTest, missingFilesAreNamed) {
    const Error entry = errorOf({.path = "passes/none/none.comp"});
    EXPECT_EQ(entry.fault(), Fault::Input);
    EXPECT_NE(entry.problem().find("passes/none/none.comp"), std::string::npos);
    const Error include = errorOf({.path = "outer.comp", .text = "#version 460\n#include \"lib/none.glsl\"\n"});
    EXPECT_NE(include.problem().find("lib/none.glsl"), std::string::npos);
    EXPECT_EQ(include.where(), "outer.comp");
}

TEST_F(ShaderTest, faultsNameFileAndLine) {
    const Error error = errorOf({.path = "wrong.comp", .text = "#version 460\nvoid main() {\n  undeclared = 1;\n}\n"});
    EXPECT_EQ(error.fault(), Fault::Run);
    EXPECT_EQ(error.where(), "wrong.comp:3");
    EXPECT_NE(error.hint().find("undeclared"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_TRUE(filesIn("spirv").empty());
}

TEST_F(ShaderTest, faultsInIncludesNameTheInclude) {
    const Error error = errorOf({.path = "outer.comp",
                                 .defines = {{"uint", "struct"}},
                                 .text = "#version 460\n#extension GL_GOOGLE_include_directive : require\n"
                                         "#include \"shared/types.h\"\nvoid main() {}\n"});
    EXPECT_EQ(error.where().rfind("shared/types.h:", 0), 0u) << error.what();
}

TEST_F(ShaderTest, definesChangeTheResult) {
    gpu::ShaderSource source{.path = "sized", .defines = {{"SIZE", "8"}}, .text = R"(#version 460
        layout(local_size_x = SIZE, local_size_y = 4) in;
        void main() {})"};
    EXPECT_EQ(gpu::compileShader(source).localSize[0], 8u);
    source.defines = {{"SIZE", "16"}};
    const gpu::ShaderModule module = gpu::compileShader(source);
    EXPECT_EQ(module.localSize[0], 16u);
    EXPECT_EQ(module.localSize[1], 4u);
    EXPECT_EQ(module.localSize[2], 1u);
    EXPECT_FALSE(module.usesTopLevel);
    EXPECT_EQ(filesIn("spirv").size(), 2u);
}

TEST_F(ShaderTest, rayQueriesAreSeen) {
    EXPECT_TRUE(gpu::compileShader({.path = "rays", .text = R"(#version 460
        #extension GL_EXT_ray_query : require
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 0) uniform accelerationStructureEXT topLevel;
        void main() {
            rayQueryEXT query;
            rayQueryInitializeEXT(query, topLevel, 0, 0xff, vec3(0), 0.0, vec3(0, 0, 1), 1.0);
            rayQueryProceedEXT(query);
        })"})
                    .usesTopLevel);
}

// ---- Caches ----------------------------------------------------------------------------------------

TEST_F(ShaderTest, cachedResultsAreUsed) {
    const gpu::ShaderModule first = gpu::compileShader(kTriple);
    ASSERT_EQ(filesIn("spirv").size(), 1u);
    const fs::path file = filesIn("spirv").front();
    const uint64_t key = std::stoull(file.stem().string(), nullptr, 16);
    // A mark in the cached module's generator word comes back only if the file was read.
    auto bytes = gpu::readCacheFile("spirv/" + file.filename().string(), key);
    ASSERT_TRUE(bytes);
    (*bytes)[8] = std::byte{0x5a};
    gpu::writeCacheFile("spirv/" + file.filename().string(), key, *bytes);
    const gpu::ShaderModule second = gpu::compileShader(kTriple);
    EXPECT_EQ(second.spirv[2] & 0xff, 0x5au);
    EXPECT_EQ(second.localSize[0], 32u);
}

TEST_F(ShaderTest, damagedSpirvIsCompiledAgain) {
    const gpu::ShaderModule good = gpu::compileShader(kTriple);
    damage(filesIn("spirv").front(),
           [&](const char* how) { EXPECT_EQ(gpu::compileShader(kTriple).spirv, good.spirv) << how; });
}

TEST_F(ShaderTest, anUnwritableCacheIsNoError) {
    setenv("XDG_CACHE_HOME", "/proc/none", 1);
    EXPECT_EQ(gpu::compileShader(kTriple).localSize[0], 32u);
}

TEST_F(ShaderTest, damagedPipelineCachesAreReplaced) {
    ASSERT_TRUE(succeeded(start(tripleWorks)));
    ASSERT_EQ(filesIn("pipelines").size(), 1u);
    damage(filesIn("pipelines").front(), [](const char* how) { EXPECT_TRUE(succeeded(start(tripleWorks))) << how; });
}

TEST_F(ShaderTest, keptShadersServeAgain) {
    ASSERT_TRUE(succeeded(start(triplesAndQuadruples)));
    const auto files = filesIn("shaders");
    if (files.empty()) GTEST_SKIP() << "this device keeps pipelines";
    ASSERT_EQ(files.size(), 2u);
    const auto times = [&] { return std::pair(fs::last_write_time(files[0]), fs::last_write_time(files[1])); };
    const auto before = times();
    EXPECT_TRUE(succeeded(start(triplesAndQuadruples)));
    EXPECT_EQ(times(), before); // found, so not written again
    damage(files[0], [](const char* how) { EXPECT_TRUE(succeeded(start(triplesAndQuadruples))) << how; });

    // Whole, but nothing that the driver knows.
    const auto good = readFile(files[1]);
    const uint64_t key = std::stoull(files[1].stem().string(), nullptr, 16);
    gpu::writeCacheFile("shaders/" + files[1].filename().string(), key, std::vector<std::byte>(500, std::byte{'x'}));
    EXPECT_TRUE(succeeded(start(triplesAndQuadruples)));
    EXPECT_EQ(readFile(files[1]), good);
}

TEST_F(ShaderTest, processesAtOnceShareTheCaches) {
    for (int round = 0; round < 3; ++round) {
        std::vector<pid_t> children;
        for (int i = 0; i < 3; ++i) children.push_back(start(tripleWorks));
        for (const pid_t child : children) EXPECT_TRUE(succeeded(child));
        ASSERT_EQ(filesIn("spirv").size(), 1u); // and no temporary file
        ASSERT_EQ(filesIn("pipelines").size(), 1u);
        if (round == 1) fs::resize_file(filesIn("spirv").front(), 20);
    }
}

} // namespace
