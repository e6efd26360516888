#pragma once

#include "scene/scene.h"

#include <filesystem>
#include <functional>
#include <memory>

namespace trilume::usd {

/// Reads an image file as a texture; throws when it can not.
using ReadTexture = std::function<Texture(const std::filesystem::path&, ColorSpace)>;

/// Fills a scene from a .usda, .usdc, .usd or .usdz stage, at its start time, else at its earliest samples. The scene's
/// source follows time when anything in the stage may vary. What is not supported or not usable is logged as a warning
/// with the prim's path, once. Takes Python's global lock while it runs.
/// Throws inputError when the file is no stage or nothing in it can be seen; runError when Python or usd-core is
/// missing.
std::unique_ptr<Scene> readStage(const std::filesystem::path& path, const ReadTexture& readTexture);

} // namespace trilume::usd
