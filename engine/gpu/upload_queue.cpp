#include "gpu/upload_queue.h"

#include "gpu/barrier.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <utility>

namespace trilume::gpu {
namespace {

constexpr size_t kPageSize = 1 << 20;
constexpr size_t kMaximumFreePages = 8;
constexpr size_t kAlignment = 16; // a texel block of the widest format

} // namespace

UploadQueue::Staged UploadQueue::stage(std::span<const std::byte> bytes) {
    used_ = (used_ + kAlignment - 1) / kAlignment * kAlignment;
    if (pages_.empty() || used_ + bytes.size() > pages_.back().size()) {
        if (bytes.size() <= kPageSize && !freePages_.empty()) {
            pages_.push_back(std::move(freePages_.back()));
            freePages_.pop_back();
        } else {
            pages_.push_back(createPage_(std::max(kPageSize, bytes.size())));
        }
        used_ = 0;
    }
    const Staged staged{pages_.back().handle(), used_};
    std::memcpy(pages_.back().mapped() + used_, bytes.data(), bytes.size());
    used_ += bytes.size();
    stagedBytes_ += bytes.size();
    return staged;
}

void UploadQueue::toBuffer(VkBuffer destination, size_t offset, std::span<const std::byte> bytes) {
    const Staged staged = stage(bytes);
    copies_.push_back(BufferCopy{staged.buffer, destination, {staged.offset, offset, bytes.size()}});
}

void UploadQueue::toImage(VkImage image, std::vector<VkBufferImageCopy> regions, std::span<const std::byte> bytes) {
    const Staged staged = stage(bytes);
    for (VkBufferImageCopy& region : regions) region.bufferOffset += staged.offset;
    copies_.push_back(ImageCopy{staged.buffer, image, std::move(regions)});
}

std::vector<Buffer> UploadQueue::record(VkCommandBuffer commands) {
    // Copies to one buffer that overlap must keep their order: the hull of what was written since the last barrier
    // tells.
    struct Hull {
        VkDeviceSize begin, end;
    };
    std::unordered_map<VkBuffer, Hull> written;
    for (const auto& copy : copies_) {
        if (const auto* toBuffer = std::get_if<BufferCopy>(&copy)) {
            const VkDeviceSize begin = toBuffer->region.dstOffset, end = begin + toBuffer->region.size;
            auto [hull, first] = written.try_emplace(toBuffer->destination, Hull{begin, end});
            if (!first && begin < hull->second.end && end > hull->second.begin) {
                recordBarrier(commands);
                written.clear();
                written.emplace(toBuffer->destination, Hull{begin, end});
            } else if (!first) {
                hull->second = {std::min(begin, hull->second.begin), std::max(end, hull->second.end)};
            }
            vkCmdCopyBuffer(commands, toBuffer->source, toBuffer->destination, 1, &toBuffer->region);
        } else {
            const auto& toImage = std::get<ImageCopy>(copy);
            recordLayout(commands, toImage.image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
            vkCmdCopyBufferToImage(commands, toImage.source, toImage.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                   static_cast<uint32_t>(toImage.regions.size()), toImage.regions.data());
            recordLayout(commands, toImage.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                         VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
        }
    }
    if (!copies_.empty()) recordBarrier(commands);
    copies_.clear();
    used_ = stagedBytes_ = 0;
    return std::exchange(pages_, {});
}

void UploadQueue::recycle(std::vector<Buffer> pages) {
    for (Buffer& page : pages)
        if (page.size() == kPageSize && freePages_.size() < kMaximumFreePages) freePages_.push_back(std::move(page));
}

void UploadQueue::clear() {
    copies_.clear();
    pages_.clear();
    freePages_.clear();
    used_ = stagedBytes_ = 0;
}

} // namespace trilume::gpu
