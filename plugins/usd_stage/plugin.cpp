#include "plugin/plugin_cpp.h"
#include "reader/usd_stage.h"

namespace {

void registerReader(trilume::Registry& registry) {
    registry.addSceneReader({".usda", ".usdc", ".usd", ".usdz"}, [&registry](const std::filesystem::path& path) {
        return trilume::usd::readStage(path, [&registry](const std::filesystem::path& file, trilume::ColorSpace space) {
            return registry.readTexture(file, space);
        });
    });
}

} // namespace

TL_PLUGIN("usd_stage", registerReader)
