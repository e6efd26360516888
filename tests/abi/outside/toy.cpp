// One of each thing that a plugin can offer.

#include "core/error.h"
#include "core/file.h"
#include "plugin/plugin_cpp.h"

#include <fstream>

namespace {

using namespace trilume;

class ToyNode final : public graph::Node {
public:
    void declare(graph::Builder& builder) override {
        const auto size = static_cast<uint32_t>(builder.params().getInt("toy.size"));
        color_ = builder.createPlane("toy.color", size);
    }
    void execute(graph::FrameContext&) override {}

private:
    graph::Plane color_;
};

std::unique_ptr<Scene> readToy(const std::filesystem::path& path) {
    if (readTextFile(path) == "broken") throw inputError("a broken toy", path.string(), "buy another");
    auto scene = std::make_unique<Scene>();
    scene->createEntity("/toy");
    return scene;
}

void registerToy(Registry& registry) {
    registry.addParam(
        {.name = "toy.size", .defaultValue = int64_t{3}, .minimum = 1, .maximum = 9, .doc = "Of the toy."});
    registry.addNode({"toy", "toy", [] { return std::make_unique<ToyNode>(); }});
    registry.addSceneReader({"toy"}, readToy);
    registry.addImageWriter({"toyimage"}, [](const std::filesystem::path& path, const ImageData& image) {
        std::ofstream(path) << image.width << " x " << image.height;
    });
    registry.addTextureReader([](const std::filesystem::path& path, ColorSpace) {
        return Texture{.name = path.string(), .width = 1, .height = 1, .rgba8 = {1, 2, 3, 4}};
    });
}

} // namespace

TL_PLUGIN("toy", registerToy)
