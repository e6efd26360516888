#pragma once

#include "gpu/device.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace trilume {

/// An array that the device reads, with the host's copy beside it: only the range that differs is uploaded.
/// T is trivially copyable and value-initialised by whoever fills it, so that bytes compare.
template<class T>
class DeviceTable {
public:
    explicit DeviceTable(std::string name) : name_(std::move(name)) {}

    /// Returns whether anything changed.
    bool assign(gpu::Device& device, std::vector<T> values) {
        const size_t common = std::min(values.size(), values_.size());
        size_t first = 0;
        while (first < common && same(values[first], values_[first])) ++first;
        if (first == values.size() && values.size() == values_.size() && buffer_) return false;
        size_t last = values.size();
        if (values.size() == values_.size())
            while (last > first && same(values[last - 1], values_[last - 1])) --last;
        if (!buffer_ || buffer_.size() < values.size() * sizeof(T)) {
            // Grows by half so that adding one at a time does not copy everything each time.
            const size_t count = buffer_ ? values.size() + values.size() / 2 : values.size();
            buffer_ = device.createBuffer(count * sizeof(T), gpu::Memory::Device, name_);
            first = 0;
            last = values.size();
        }
        values_ = std::move(values);
        if (last > first)
            device.upload(buffer_, first * sizeof(T), std::as_bytes(std::span(values_).subspan(first, last - first)));
        return true;
    }

    const std::vector<T>& values() const { return values_; }
    uint32_t size() const { return static_cast<uint32_t>(values_.size()); }
    VkDeviceAddress address() const { return buffer_.address(); }

private:
    static bool same(const T& a, const T& b) { return std::memcmp(&a, &b, sizeof(T)) == 0; }

    std::string name_;
    std::vector<T> values_;
    gpu::Buffer buffer_;
};

} // namespace trilume
