#pragma once

#include "core/error.h"
#include "core/log.h"
#include "reader/usd_stage.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#ifdef __SANITIZE_ADDRESS__
/// USD keeps pointers to these with a tag in them, which the leak check does not recognise.
extern "C" const char* __lsan_default_suppressions() { return "leak:Sdf_IdentityRegistry"; }
#endif

namespace trilume::usd {

/// Reads stages from text, with a texture reader that takes any file, and keeps the warnings.
class UsdStage : public ::testing::Test {
protected:
    void SetUp() override {
        const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
        folder_ =
            std::filesystem::temp_directory_path() / ("trilume_usd_" + std::to_string(getpid()) + "_" + test->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
        log::setSink([this](log::Level level, std::string_view line) {
            if (level >= log::Level::Warning) warnings_.emplace_back(line);
        });
    }
    void TearDown() override {
        log::setSink({});
        std::filesystem::remove_all(folder_);
    }

    std::filesystem::path write(const std::string& name, std::string_view content) const {
        std::ofstream(folder_ / name, std::ios::binary) << content;
        return folder_ / name;
    }

    std::unique_ptr<Scene> readFile(const std::filesystem::path& path) const {
        auto scene = readStage(path, [](const std::filesystem::path& file, ColorSpace space) {
            if (std::filesystem::file_size(file) == 0)
                throw inputError("the image is empty", file.string(), "check the file");
            Texture texture;
            texture.name = file.string();
            texture.width = texture.height = 1;
            texture.rgba8 = {255, 255, 255, 255};
            texture.srgb = space != ColorSpace::Linear;
            return texture;
        });
        scene->updateTransforms();
        return scene;
    }

    /// `metadata`: what stands between the parentheses below the first line.
    std::unique_ptr<Scene> read(std::string_view prims, std::string_view metadata = "metersPerUnit = 1") const {
        return readFile(write("stage.usda", "#usda 1.0\n(\n" + std::string(metadata) + "\n)\n" + std::string(prims)));
    }

    static Entity find(const Scene& scene, std::string_view path) {
        Entity found;
        scene.world.each<Name>([&](Entity e, const Name& name) {
            if (name.path == path) found = e;
        });
        EXPECT_TRUE(found) << path;
        return found;
    }

    template<class C>
    static C get(const Scene& scene, std::string_view path) {
        const C* component = scene.world.find<C>(find(scene, path));
        EXPECT_NE(component, nullptr) << path;
        return component ? *component : C{};
    }

    static glm::dvec3 position(const Scene& scene, std::string_view path, glm::dvec3 local = glm::dvec3(0)) {
        return get<WorldTransform>(scene, path).worldFromLocal * glm::dvec4(local, 1);
    }

    const Mesh& meshOf(const Scene& scene, std::string_view path) const {
        return scene.mesh(get<MeshInstance>(scene, path).mesh);
    }

    const Material& materialOf(const Scene& scene, std::string_view path, size_t subset = 0) const {
        return scene.material(get<MeshInstance>(scene, path).materials.at(subset));
    }

    bool warned(std::string_view part) const {
        for (const std::string& line : warnings_)
            if (line.find(part) != std::string::npos) return true;
        return false;
    }

    std::string allWarnings() const {
        std::string all;
        for (const std::string& line : warnings_) all += line + "\n";
        return all;
    }

    std::filesystem::path folder_;
    std::vector<std::string> warnings_;
};

inline void expectNear(glm::dvec3 a, glm::dvec3 b, double tolerance = 1e-9) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

/// A unit square in the xy plane, facing +z.
inline constexpr std::string_view kSquare = R"(
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
)";

/// Prim text of a mesh with the square and what else is given.
inline std::string square(std::string_view name, std::string_view more = "") {
    return "def Mesh \"" + std::string(name) + "\"\n{\n" + std::string(kSquare) + std::string(more) + "\n}\n";
}

} // namespace trilume::usd
