#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace trilume {

/// Writes a colour PFM in the machine's byte order: float32, linear, as given. `rgb` holds width * height * 3 values,
/// row 0 at the top (the file stores the bottom row first). Throws runError when writing fails. Not atomic by itself.
void writePfm(const std::filesystem::path& path, uint32_t width, uint32_t height, std::span<const float> rgb);

/// Whether the file is a colour PFM that holds all the values that its header promises.
bool isWholePfm(const std::filesystem::path& path);

} // namespace trilume
