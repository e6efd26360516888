#pragma once

#include "plugin/registry.h"

namespace trilume {

/// A plugin.json: what a plugin offers, known without loading it.
struct PluginManifest {
    Registry::PluginInfo info;
    std::filesystem::path library;
    std::vector<Technique> techniques;
};

/// Reads `directory`/plugin.json. Throws inputError naming the file and the key that is wrong.
PluginManifest readManifest(const std::filesystem::path& directory);

/// Reads a techniques.json: an array of {name, doc, nodes[], defaults{}, reference, rank}; all but name and nodes may
/// be missing. Throws inputError naming the file and the key that is wrong.
std::vector<Technique> readTechniques(const std::filesystem::path& file);

/// `exr`, `.EXR` and `.exr` as `.exr`.
std::string normalizedExtension(std::string_view extension);

} // namespace trilume
