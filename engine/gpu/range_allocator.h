#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace trilume::gpu {

/// Hands out ranges of [0, size) by best fit and merges what comes back with its neighbours.
class RangeAllocator {
public:
    explicit RangeAllocator(uint64_t size) : size_(size) { free_.emplace(0, size); }

    /// Offset of a range of `size` bytes, a multiple of `alignment`; nothing when no free range can hold it.
    std::optional<uint64_t> allocate(uint64_t size, uint64_t alignment);
    /// Returns a range that allocate gave out, with the same size.
    void release(uint64_t offset, uint64_t size);
    /// True when nothing is handed out.
    bool empty() const { return free_.size() == 1 && free_.begin()->second == size_; }

private:
    uint64_t size_;
    std::map<uint64_t, uint64_t> free_; ///< offset to size; never adjacent
};

} // namespace trilume::gpu
