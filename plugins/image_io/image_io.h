#pragma once

#include "plugin/registry.h"

#include <filesystem>

namespace trilume {

/// Writes by the path's extension. `.exr`: float32, ZIP, linear Rec. 709 with its chromaticities in the header. `.hdr`:
/// RGBE, values below 0 as 0. `.png`, `.jpg`: 8 bits, values 0..1 taken as sRGB-encoded and clamped. Alpha is dropped;
/// one channel stays one (`.hdr`: grey), two are named X and Y. Throws runError when the file can't be written.
void writeImageFile(const std::filesystem::path& path, const ImageData& image);

/// Reads the first image of a file: 8-bit channels as they are, others as linear float. Alpha stays unassociated; grey
/// spreads over RGB. ColorSpace::Auto takes 8-bit colour (3 or 4 channels) as sRGB and all else as linear, as
/// UsdPreviewSurface does. Throws inputError naming the file when it can't be read.
Texture readTextureFile(const std::filesystem::path& path, ColorSpace colorSpace);

} // namespace trilume
