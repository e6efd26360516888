#pragma once

#include "gpu/adapter.h"
#include "gpu/range_allocator.h"

#include <list>
#include <optional>

namespace trilume::gpu {

struct MemoryBlock;

/// A piece of device memory; given back by MemoryAllocator::release.
struct Allocation {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    uint64_t offset = 0, size = 0;
    std::byte* mapped = nullptr; ///< null when the host can't see it
    bool cached = false;         ///< fast to read by the host
    MemoryBlock* block = nullptr;
};

/// Sub-allocates blocks of device memory, one list of blocks for each memory type; large requests get their own block.
/// Buffers and images live in separate blocks, so bufferImageGranularity never matters. All of it has device addresses.
class MemoryAllocator {
public:
    enum class Kind { Buffer, Image };

    /// `limit`: bytes to take at most; 0: the heap's size.
    MemoryAllocator(const Adapter& adapter, VkDevice device, uint64_t limit);
    ~MemoryAllocator();
    MemoryAllocator(const MemoryAllocator&) = delete;
    MemoryAllocator& operator=(const MemoryAllocator&) = delete;

    /// Nothing when the device's memory or the limit is exhausted.
    std::optional<Allocation> allocate(const VkMemoryRequirements& requirements, Memory memory, Kind kind);
    void release(const Allocation& allocation);

    uint64_t inUse() const { return inUse_; } ///< bytes handed out
    uint64_t capacity() const;                ///< bytes that the device-local heap may give

private:
    std::optional<uint32_t> chooseType(uint32_t allowed, Memory memory) const;
    bool fits(uint32_t heap, uint64_t size) const;
    MemoryBlock* createBlock(uint32_t type, Kind kind, uint64_t size);

    const Adapter& adapter_;
    VkDevice device_;
    VkPhysicalDeviceMemoryProperties properties_{};
    uint64_t limit_, inUse_ = 0;
    uint64_t heapUse_[VK_MAX_MEMORY_HEAPS] = {}; ///< bytes of blocks
    std::list<MemoryBlock> blocks_;
};

struct MemoryBlock {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    uint32_t type = 0;
    MemoryAllocator::Kind kind{};
    uint64_t size = 0;
    std::byte* mapped = nullptr;
    RangeAllocator ranges;
};

} // namespace trilume::gpu
