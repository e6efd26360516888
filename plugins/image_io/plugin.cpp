#include "image_io.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) {
    registry.addImageWriter({"exr", "hdr", "png", "jpg", "jpeg"}, trilume::writeImageFile);
    registry.addTextureReader(trilume::readTextureFile);
}

TL_PLUGIN("image_io", registerPlugin)
