#include "gpu/range_allocator.h"

#include <iterator>

namespace trilume::gpu {

std::optional<uint64_t> RangeAllocator::allocate(uint64_t size, uint64_t alignment) {
    const auto aligned = [alignment](uint64_t offset) { return (offset + alignment - 1) / alignment * alignment; };
    auto best = free_.end();
    for (auto range = free_.begin(); range != free_.end(); ++range) {
        const uint64_t padding = aligned(range->first) - range->first;
        const bool fits = range->second >= padding && range->second - padding >= size;
        if (fits && (best == free_.end() || range->second < best->second)) best = range;
    }
    if (best == free_.end()) return std::nullopt;

    const auto [start, length] = *best;
    const uint64_t offset = aligned(start);
    free_.erase(best);
    if (offset > start) free_.emplace(start, offset - start);
    if (offset + size < start + length) free_.emplace(offset + size, start + length - offset - size);
    return offset;
}

void RangeAllocator::release(uint64_t offset, uint64_t size) {
    auto next = free_.lower_bound(offset);
    if (next != free_.end() && offset + size == next->first) {
        size += next->second;
        next = free_.erase(next);
    }
    if (next != free_.begin()) {
        const auto before = std::prev(next);
        if (before->first + before->second == offset) {
            before->second += size;
            return;
        }
    }
    free_.emplace(offset, size);
}

} // namespace trilume::gpu
