#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace trilume {

/// Reads a whole file. Throws inputError naming the path when it is missing, a directory or unreadable.
std::vector<std::byte> readFile(const std::filesystem::path& path);
std::string readTextFile(const std::filesystem::path& path);

/// Calls `write(temporary)` with a path beside `path` (same directory, same extension), then renames it over `path`.
/// When `write` throws, the temporary file is removed and nothing of `path` has changed. A symbolic link stays one; a
/// device or pipe is written to directly.
/// Throws inputError when the directory is missing or not writable.
void writeFileAtomically(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path& temporary)>& write);
void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Throws the inputError that writeFileAtomically would, before the work whose result it is to hold.
void checkWritable(const std::filesystem::path& path);

/// Where the installation's shaders, techniques and plugins stand, found from the place of the engine library itself,
/// so that an installed package can be moved. TRILUME_HOME overrides. Layout: <home>/share/trilume/shaders,
/// <home>/share/trilume/techniques.json, <home>/lib/trilume/plugins/<name>/plugin.json.
std::filesystem::path homeDirectory();

/// The user's cache folder for Trilume ($XDG_CACHE_HOME/trilume, else ~/.cache/trilume), created on demand;
/// empty when none can be written.
std::filesystem::path cacheDirectory();

/// 64-bit FNV-1a, for cache keys and checksums of own files; not for untrusted input.
uint64_t hashBytes(std::span<const std::byte> bytes, uint64_t seed = 0xcbf29ce484222325ull);

} // namespace trilume
