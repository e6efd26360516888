#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace trilume::graph {

constexpr size_t kArenaAlignment = 256; ///< bytes; a multiple of every Vulkan buffer alignment in use

/// A block that is in use from pass `first` to pass `last`, both included.
struct Block {
    size_t bytes = 0;
    uint32_t first = 0, last = 0;
    size_t offset = 0; ///< result
};

/// Gives blocks whose lives overlap disjoint, aligned ranges of one arena: largest first, each at the lowest offset
/// that is free. Blocks of 0 bytes take one unit of alignment. Returns the size of the arena in bytes.
size_t placeInArena(std::span<Block> blocks);

} // namespace trilume::graph
