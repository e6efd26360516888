#include "graph/arena.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace trilume::graph {

namespace {

size_t alignedSize(const Block& block) {
    return (std::max<size_t>(block.bytes, 1) + kArenaAlignment - 1) / kArenaAlignment * kArenaAlignment;
}

} // namespace

size_t placeInArena(std::span<Block> blocks) {
    std::vector<size_t> order(blocks.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return blocks[a].bytes > blocks[b].bytes; });

    size_t arena = 0;
    std::vector<const Block*> placed; // by offset
    for (const size_t index : order) {
        Block& block = blocks[index];
        const size_t size = alignedSize(block);
        block.offset = 0;
        for (const Block* other : placed) {
            if (other->first > block.last || block.first > other->last) continue;
            if (block.offset + size <= other->offset) break;
            block.offset = std::max(block.offset, other->offset + alignedSize(*other));
        }
        placed.insert(std::upper_bound(placed.begin(), placed.end(), &block,
                                       [](const Block* a, const Block* b) { return a->offset < b->offset; }),
                      &block);
        arena = std::max(arena, block.offset + size);
    }
    return arena;
}

} // namespace trilume::graph
