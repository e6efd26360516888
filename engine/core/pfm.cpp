#include "core/pfm.h"

#include "core/error.h"

#include <bit>
#include <fstream>
#include <string>

namespace trilume {

void writePfm(const std::filesystem::path& path, uint32_t width, uint32_t height, std::span<const float> rgb) {
    const size_t rowLength = size_t{width} * 3;
    if (rgb.size() != rowLength * height)
        throw runError("cannot write image", path.string(), "the number of values does not match its width and height");
    std::ofstream stream(path, std::ios::binary);
    // The sign of the scale says the byte order.
    stream << "PF\n"
           << width << ' ' << height << '\n'
           << (std::endian::native == std::endian::little ? "-1.0" : "1.0") << '\n';
    for (size_t y = height; y-- > 0;) {
        const auto row = std::as_bytes(rgb.subspan(y * rowLength, rowLength));
        stream.write(reinterpret_cast<const char*>(row.data()), static_cast<std::streamsize>(row.size()));
    }
    stream.close();
    if (!stream) throw runError("cannot write image", path.string(), "writing failed: is the disk full?");
}

bool isWholePfm(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    std::string magic;
    uint64_t width = 0, height = 0;
    double scale = 0;
    if (!(stream >> magic >> width >> height >> scale) || magic != "PF") return false;
    stream.get(); // One white space ends the header.
    const auto headerBytes = static_cast<uint64_t>(stream.tellg());
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(path, error);
    return !error && bytes == headerBytes + width * height * 3 * sizeof(float);
}

} // namespace trilume
