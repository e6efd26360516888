#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace trilume::gpu {

/// Contents of the cache entry `name` ("spirv/0123.spv") written for `key`. Nothing when it is absent, was written for
/// another key or by another version, is cut short, or fails its checksum: a cache never fails a run.
std::optional<std::vector<std::byte>> readCacheFile(std::string_view name, uint64_t key);

/// Writes the entry through a temporary file and a rename, so that readers and writers in other processes see the old
/// or the new entry whole. What goes wrong is logged and otherwise ignored.
void writeCacheFile(std::string_view name, uint64_t key, std::span<const std::byte> contents);

} // namespace trilume::gpu
