#pragma once

#include "gpu/device.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace trilume::gpu {

/// An array that the device reads, with the host's copy beside it: only the range that differs is uploaded. What the
/// device read before the last change stays at its address until the next one.
/// T is trivially copyable and value-initialised by whoever fills it, so that bytes compare.
template<class T>
class DeviceTable {
public:
    explicit DeviceTable(std::string name) : name_(std::move(name)) {}

    /// Returns whether anything changed.
    bool assign(Device& device, std::vector<T> values) {
        const size_t common = std::min(values.size(), values_.size());
        size_t first = 0;
        while (first < common && same(values[first], values_[first])) ++first;
        if (first == values.size() && values.size() == values_.size() && buffer_) return false;
        size_t last = values.size();
        if (values.size() == values_.size())
            while (last > first && same(values[last - 1], values_[last - 1])) --last;
        const bool grows = values.size() > values_.size();
        values_ = std::move(values);
        store(device, first, last, grows);
        return true;
    }

    /// Replaces values of the array, given by index. Returns whether anything changed.
    bool replace(Device& device, std::span<const std::pair<uint32_t, T>> values) {
        size_t first = values_.size(), last = 0;
        for (const auto& [index, value] : values) {
            if (same(values_[index], value)) continue;
            values_[index] = value;
            first = std::min<size_t>(first, index);
            last = std::max<size_t>(last, index + 1);
        }
        if (first >= last) return false;
        store(device, first, last, false);
        return true;
    }

    const std::vector<T>& values() const { return values_; }
    uint32_t size() const { return static_cast<uint32_t>(values_.size()); }
    VkDeviceAddress address() const { return buffer_.address(); }

private:
    /// Uploads what changed, from `first` to before `last`.
    void store(Device& device, size_t first, size_t last, bool grows) {
        // The buffer of the time before last lacks the last change and this one.
        std::swap(buffer_, other_);
        size_t from = std::min(first, outdatedFirst_), to = std::max(last, outdatedLast_);
        if (!buffer_ || buffer_.size() < values_.size() * sizeof(T)) {
            // Grows by half so that adding one at a time does not copy everything each time.
            const size_t count = other_ && grows ? values_.size() + values_.size() / 2 : values_.size();
            buffer_ = device.createBuffer(count * sizeof(T), Memory::Device, name_);
            from = 0;
            to = values_.size();
        }
        outdatedFirst_ = first;
        outdatedLast_ = last;
        to = std::min(to, values_.size());
        if (to > from)
            device.upload(buffer_, from * sizeof(T), std::as_bytes(std::span(values_).subspan(from, to - from)));
    }
    static bool same(const T& a, const T& b) { return std::memcmp(&a, &b, sizeof(T)) == 0; }

    std::string name_;
    std::vector<T> values_;
    Buffer buffer_, other_;
    size_t outdatedFirst_ = 0, outdatedLast_ = 0; ///< of other_
};

} // namespace trilume::gpu
