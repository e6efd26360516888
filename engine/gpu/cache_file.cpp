#include "gpu/cache_file.h"

#include "core/file.h"
#include "core/log.h"

#include <array>
#include <cstring>

namespace trilume::gpu {
namespace {

struct Header {
    std::array<char, 8> magic{'T', 'L', 'C', 'A', 'C', 'H', 'E', '1'};
    uint64_t key = 0;
    uint64_t size = 0;     ///< bytes that follow
    uint64_t checksum = 0; ///< of them
};

} // namespace

std::optional<std::vector<std::byte>> readCacheFile(std::string_view name, uint64_t key) {
    try {
        const auto directory = cacheDirectory();
        if (directory.empty() || !std::filesystem::exists(directory / name)) return std::nullopt;
        std::vector<std::byte> bytes = readFile(directory / name);
        Header header;
        if (bytes.size() < sizeof header) return std::nullopt;
        std::memcpy(&header, bytes.data(), sizeof header);
        bytes.erase(bytes.begin(), bytes.begin() + sizeof header);
        if (header.magic != Header{}.magic || header.key != key || header.size != bytes.size() ||
            header.checksum != hashBytes(bytes))
            return std::nullopt;
        return bytes;
    } catch (const std::exception& error) {
        log::debug("cache: {}", error.what());
        return std::nullopt;
    }
}

void writeCacheFile(std::string_view name, uint64_t key, std::span<const std::byte> contents) {
    try {
        const auto directory = cacheDirectory();
        if (directory.empty()) return;
        Header header{.key = key, .size = contents.size(), .checksum = hashBytes(contents)};
        std::vector<std::byte> bytes(sizeof header + contents.size());
        std::memcpy(bytes.data(), &header, sizeof header);
        if (!contents.empty()) std::memcpy(bytes.data() + sizeof header, contents.data(), contents.size());
        std::filesystem::create_directories((directory / name).parent_path());
        writeFileAtomically(directory / name, bytes);
    } catch (const std::exception& error) {
        log::debug("cache: {}", error.what());
    }
}

} // namespace trilume::gpu
