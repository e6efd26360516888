#pragma once

#include "scene/scene.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

namespace trilume {

/// What a snapshot holds.
struct SnapshotSummary {
    size_t bytes = 0;
    size_t meshes = 0, triangles = 0, instances = 0, materials = 0, textures = 0, lights = 0, cameras = 0;
    size_t tracks = 0, keys = 0; ///< what varies with time, and its values
};

/// Writes the scene as it stands and as its source moves it: at the source's sample times and at whole frames from the
/// first of them to the last, or, with `frames`, at those and at the samples between. Moves the scene through time.
/// Equal scenes give equal bytes. Throws inputError when the file can't be written or the times are too many.
SnapshotSummary writeSnapshot(Scene& scene, const std::filesystem::path& path, std::span<const double> frames = {});

/// Reads what writeSnapshot wrote; its source follows time as far as the file does. Whatever the file holds, it either
/// becomes a sound scene or throws inputError; what varies with time may do so in setTime.
std::unique_ptr<Scene> readSnapshot(const std::filesystem::path& path);

} // namespace trilume
