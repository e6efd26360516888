#pragma once

#include "gpu/device.h"

#include <variant>

namespace trilume::gpu {

/// Host data on its way to the device: copied into staging pages at once, into its place by the next submission.
class UploadQueue {
public:
    explicit UploadQueue(std::function<Buffer(size_t bytes)> createPage) : createPage_(std::move(createPage)) {}

    bool empty() const { return copies_.empty(); }
    size_t stagedBytes() const { return stagedBytes_; }

    void toBuffer(VkBuffer destination, size_t offset, std::span<const std::byte> bytes);
    /// `regions` with buffer offsets relative to `bytes`; the image goes from UNDEFINED to SHADER_READ_ONLY_OPTIMAL.
    void toImage(VkImage image, std::vector<VkBufferImageCopy> regions, std::span<const std::byte> bytes);

    /// Records the copies in order, with the barriers that they and what follows need, and forgets them. The staging
    /// pages are returned: keep them until the commands have completed, then give them to `recycle`.
    std::vector<Buffer> record(VkCommandBuffer commands);
    void recycle(std::vector<Buffer> pages);
    /// Drops everything that is queued or kept.
    void clear();

private:
    struct BufferCopy {
        VkBuffer source, destination;
        VkBufferCopy region;
    };
    struct ImageCopy {
        VkBuffer source;
        VkImage image;
        std::vector<VkBufferImageCopy> regions;
    };
    struct Staged {
        VkBuffer buffer;
        size_t offset;
    };
    Staged stage(std::span<const std::byte> bytes);

    std::function<Buffer(size_t bytes)> createPage_;
    std::vector<Buffer> pages_, freePages_; ///< pages_.back() is the one being filled
    size_t used_ = 0;                       ///< bytes of pages_.back()
    size_t stagedBytes_ = 0;
    std::vector<std::variant<BufferCopy, ImageCopy>> copies_;
};

} // namespace trilume::gpu
