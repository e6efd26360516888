#include "gpu/device_impl.h"

#include "core/error.h"
#include "gpu/result.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace trilume::gpu {
namespace {

constexpr size_t kMinimumSize = 16;

void checkRange(const Buffer& buffer, size_t offset, size_t bytes, const char* operation) {
    if (offset > buffer.size() || bytes > buffer.size() - offset)
        throw runError(fmt::format("{} of {} bytes at {} does not fit", operation, bytes, offset),
                       fmt::format("buffer of {} bytes", buffer.size()), "this is a fault in the program");
}

} // namespace

Buffer::Buffer() = default;
Buffer::Buffer(Buffer&& other) noexcept
    : impl_(std::move(other.impl_)), address_(std::exchange(other.address_, 0)), size_(std::exchange(other.size_, 0)),
      mapped_(std::exchange(other.mapped_, nullptr)) {}
Buffer& Buffer::operator=(Buffer&& other) noexcept {
    impl_ = std::move(other.impl_);
    address_ = std::exchange(other.address_, 0);
    size_ = std::exchange(other.size_, 0);
    mapped_ = std::exchange(other.mapped_, nullptr);
    return *this;
}
Buffer::~Buffer() = default;
VkBuffer Buffer::handle() const { return impl_ ? impl_->handle : VK_NULL_HANDLE; }

Buffer::Impl::~Impl() {
    if (!handle) return;
    device.retire([owner = &device, handle = handle, memory = memory] {
        vkDestroyBuffer(owner->device.handle, handle, nullptr);
        if (memory.block) owner->memory.release(memory);
    });
}

Buffer Device::createBuffer(size_t bytes, Memory memory, std::string_view what, VkBufferUsageFlags extra) {
    VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = std::max(bytes, kMinimumSize);
    info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                 VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | extra;
    VkMemoryRequirements requirements{};
    requirements.size = info.size;
    Buffer buffer;
    buffer.impl_ = std::make_unique<Buffer::Impl>(*impl_);
    if (info.size <= impl_->adapter.maxAllocation) { // else only ask for what can't be had, for the message
        check(vkCreateBuffer(handle(), &info, nullptr, &buffer.impl_->handle), "vkCreateBuffer");
        vkGetBufferMemoryRequirements(handle(), buffer.impl_->handle, &requirements);
    } else {
        requirements.memoryTypeBits = ~0u;
    }
    Allocation& allocation = buffer.impl_->memory;
    allocation = impl_->allocate(*this, requirements, memory, MemoryAllocator::Kind::Buffer, what, info.size);
    check(vkBindBufferMemory(handle(), buffer.impl_->handle, allocation.memory, allocation.offset),
          "vkBindBufferMemory");

    VkBufferDeviceAddressInfo address{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    address.buffer = buffer.impl_->handle;
    buffer.address_ = vkGetBufferDeviceAddress(handle(), &address);
    buffer.size_ = info.size;
    buffer.mapped_ = allocation.mapped;
    return buffer;
}

void Device::upload(Buffer& buffer, size_t offset, std::span<const std::byte> bytes) {
    checkRange(buffer, offset, bytes.size(), "an upload");
    if (bytes.empty()) return;
    impl_->uploadedBytes += bytes.size();
    UploadQueue& uploads = *impl_->uploads;
    const bool idle = impl_->frames.completed() == impl_->frames.submitted();
    if (buffer.mapped() && idle && uploads.empty()) {
        std::memcpy(buffer.mapped() + offset, bytes.data(), bytes.size());
        return;
    }
    for (size_t done = 0; done < bytes.size(); done += kStagingBytes) {
        const auto chunk = bytes.subspan(done, std::min(kStagingBytes, bytes.size() - done));
        uploads.toBuffer(buffer.handle(), offset + done, chunk);
        impl_->limitStaging(*this);
    }
}

void Device::download(const Buffer& buffer, size_t offset, std::span<std::byte> bytes) {
    checkRange(buffer, offset, bytes.size(), "a download");
    if (bytes.empty()) return;
    impl_->flush(*this);
    waitIdle();
    if (buffer.mapped() && buffer.impl_->memory.cached) {
        std::memcpy(bytes.data(), buffer.mapped() + offset, bytes.size());
        return;
    }
    const Buffer staging =
        createBuffer(std::min(kStagingBytes, bytes.size()), Memory::Readback, "staging of downloads");
    for (size_t done = 0; done < bytes.size(); done += kStagingBytes) {
        const size_t size = std::min(kStagingBytes, bytes.size() - done);
        wait(submit([&](Commands& commands) { commands.copy(buffer, offset + done, staging, 0, size); }));
        std::memcpy(bytes.data() + done, staging.mapped(), size);
    }
}

} // namespace trilume::gpu
