#include "gpu/memory.h"

#include "gpu/result.h"

#include <algorithm>

namespace trilume::gpu {
namespace {

constexpr uint64_t kBlockSize = 64ull << 20;
/// Acceleration structures and their scratch ask for 256; offsets of other uses ask for less.
constexpr uint64_t kMinimumAlignment = 256;

constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

} // namespace

MemoryAllocator::MemoryAllocator(const Adapter& adapter, VkDevice device, uint64_t limit)
    : adapter_(adapter), device_(device), limit_(limit ? limit : UINT64_MAX) {
    vkGetPhysicalDeviceMemoryProperties(adapter.handle, &properties_);
}

MemoryAllocator::~MemoryAllocator() {
    for (const MemoryBlock& block : blocks_) vkFreeMemory(device_, block.memory, nullptr);
}

uint64_t MemoryAllocator::capacity() const {
    uint64_t local = 0;
    for (uint32_t i = 0; i < properties_.memoryHeapCount; ++i)
        if (properties_.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            local = std::max(local, properties_.memoryHeaps[i].size);
    return std::min(local, limit_);
}

std::optional<uint32_t> MemoryAllocator::chooseType(uint32_t allowed, Memory memory) const {
    // Best first. Where device and host share their memory (CPU, integrated), Memory::Device is mapped as well.
    const bool unified = adapter_.info.type == "cpu" || adapter_.info.type == "integrated";
    std::vector<VkMemoryPropertyFlags> wishes;
    if (memory == Memory::Readback)
        wishes = {kHost | kCached, kHost};
    else if (memory == Memory::Upload)
        wishes = {kHost};
    else if (unified)
        wishes = {kLocal | kHost | kCached, kLocal | kHost, kLocal, 0};
    else
        wishes = {kLocal, 0};
    for (const VkMemoryPropertyFlags wish : wishes)
        for (uint32_t i = 0; i < properties_.memoryTypeCount; ++i)
            if ((allowed & (1u << i)) && (properties_.memoryTypes[i].propertyFlags & wish) == wish) return i;
    return std::nullopt;
}

bool MemoryAllocator::fits(uint32_t heap, uint64_t size) const {
    if (heapUse_[heap] + size > std::min(properties_.memoryHeaps[heap].size, limit_)) return false;
    if (!adapter_.memoryBudget) return true;
    // A CPU device hands out more than the machine has; the budget says what is really left.
    VkPhysicalDeviceMemoryBudgetPropertiesEXT budget{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT};
    VkPhysicalDeviceMemoryProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_PROPERTIES_2, &budget};
    vkGetPhysicalDeviceMemoryProperties2(adapter_.handle, &properties);
    return budget.heapUsage[heap] + size <= budget.heapBudget[heap];
}

MemoryBlock* MemoryAllocator::createBlock(uint32_t type, Kind kind, uint64_t size) {
    const uint32_t heap = properties_.memoryTypes[type].heapIndex;
    if (size > adapter_.maxAllocation || !fits(heap, size)) return nullptr;

    VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &flags};
    info.allocationSize = size;
    info.memoryTypeIndex = type;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    const VkResult result = vkAllocateMemory(device_, &info, nullptr, &memory);
    if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY ||
        result == VK_ERROR_TOO_MANY_OBJECTS)
        return nullptr;
    check(result, "vkAllocateMemory");

    MemoryBlock& block = blocks_.emplace_back(
        MemoryBlock{.memory = memory, .type = type, .kind = kind, .size = size, .ranges = RangeAllocator(size)});
    heapUse_[heap] += size;
    if (properties_.memoryTypes[type].propertyFlags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) {
        void* mapped = nullptr;
        check(vkMapMemory(device_, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
        block.mapped = static_cast<std::byte*>(mapped);
    }
    return &block;
}

std::optional<Allocation> MemoryAllocator::allocate(const VkMemoryRequirements& requirements, Memory memory,
                                                    Kind kind) {
    const auto type = chooseType(requirements.memoryTypeBits, memory);
    if (!type) return std::nullopt;
    const uint64_t alignment = std::max<uint64_t>(requirements.alignment, kMinimumAlignment);
    const VkMemoryType& properties = properties_.memoryTypes[*type];
    const uint64_t heapSize = std::min(properties_.memoryHeaps[properties.heapIndex].size, limit_);
    const uint64_t blockSize = std::min(kBlockSize, heapSize / 8);

    const auto take = [&](MemoryBlock& block) -> std::optional<Allocation> {
        const auto offset = block.ranges.allocate(requirements.size, alignment);
        if (!offset) return std::nullopt;
        inUse_ += requirements.size;
        return Allocation{.memory = block.memory,
                          .offset = *offset,
                          .size = requirements.size,
                          .mapped = block.mapped ? block.mapped + *offset : nullptr,
                          .cached = (properties.propertyFlags & VK_MEMORY_PROPERTY_HOST_CACHED_BIT) != 0,
                          .block = &block};
    };
    if (requirements.size <= blockSize / 2) {
        for (MemoryBlock& block : blocks_)
            if (block.type == *type && block.kind == kind)
                if (auto allocation = take(block)) return allocation;
        if (MemoryBlock* block = createBlock(*type, kind, blockSize)) return take(*block);
    }
    MemoryBlock* own = createBlock(*type, kind, requirements.size);
    return own ? take(*own) : std::nullopt;
}

void MemoryAllocator::release(const Allocation& allocation) {
    MemoryBlock& block = *allocation.block;
    block.ranges.release(allocation.offset, allocation.size);
    inUse_ -= allocation.size;
    if (!block.ranges.empty()) return;
    // One empty standard block of a kind is kept, so that a buffer made and freed each frame costs no allocation.
    const bool spare = std::ranges::any_of(blocks_, [&](const MemoryBlock& other) {
        return &other != &block && other.type == block.type && other.kind == block.kind && other.ranges.empty();
    });
    if (block.size == kBlockSize && !spare) return;
    heapUse_[properties_.memoryTypes[block.type].heapIndex] -= block.size;
    vkFreeMemory(device_, block.memory, nullptr);
    blocks_.remove_if([&](const MemoryBlock& other) { return &other == &block; });
}

} // namespace trilume::gpu
