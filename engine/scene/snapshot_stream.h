#pragma once

#include "core/error.h"
#include "scene/snapshot_fields.h"
#include "scene/snapshot_format.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <string>

namespace trilume::snapshot {

/// Appends values to a file's bytes. Arrays of plain values are aligned as they lie in memory.
class Writer {
public:
    Writer() : bytes_(sizeof(Header)) {}

    template<class T>
    void operator()(const T& value) {
        if constexpr (Record<T>)
            fields(*this, value);
        else if constexpr (std::same_as<T, bool>)
            (*this)(static_cast<uint8_t>(value));
        else if constexpr (std::is_enum_v<T>)
            (*this)(static_cast<uint32_t>(value));
        else
            append(&value, sizeof(T));
    }
    void operator()(const std::string& text) {
        (*this)(uint64_t{text.size()});
        append(text.data(), text.size());
    }
    template<class T>
    void operator()(const std::vector<T>& values) {
        (*this)(uint64_t{values.size()});
        if constexpr (Plain<T>) {
            align(alignof(T));
            append(values.data(), values.size() * sizeof(T));
        } else {
            for (const T& value : values) (*this)(value);
        }
    }
    template<class T>
    void operator()(const std::optional<T>& value) {
        (*this)(value.has_value());
        if (value) (*this)(*value);
    }

    /// What is written from here on belongs to the section.
    void begin(Section section) {
        end();
        align(kAlignment);
        open_ = section;
        range(section).offset = bytes_.size();
    }
    /// The whole file.
    std::span<const std::byte> finish() {
        end();
        align(kAlignment);
        header_.magic = kMagic;
        header_.byteOrder = kByteOrder;
        header_.version = kVersion;
        header_.fileBytes = bytes_.size();
        std::memcpy(bytes_.data(), &header_, sizeof(header_));
        header_.checksum = checksum(std::span(bytes_).subspan(kUnchecked));
        std::memcpy(bytes_.data(), &header_, sizeof(header_));
        return bytes_;
    }

private:
    Range& range(Section section) { return header_.sections[static_cast<size_t>(section)]; }
    void end() {
        if (open_) range(*open_).bytes = bytes_.size() - range(*open_).offset;
    }
    void append(const void* data, size_t size) {
        const auto* from = static_cast<const std::byte*>(data);
        bytes_.insert(bytes_.end(), from, from + size);
    }
    void align(size_t alignment) { bytes_.resize((bytes_.size() + alignment - 1) / alignment * alignment); }

    std::vector<std::byte> bytes_;
    Header header_{};
    std::optional<Section> open_;
};

/// How many of each kind there are: what ids may name.
struct Counts {
    uint32_t textures = 0, materials = 0, meshes = 0, entities = 0;
};
template<class F, Is<Counts>... A>
void fields(F&& f, A&... a) {
    f(a.textures...);
    f(a.materials...);
    f(a.meshes...);
    f(a.entities...);
}

inline Error damaged(const char* what, const std::string& where) {
    return inputError(std::string("the file is damaged (") + what + ")", where, "cook the stage again");
}

/// Takes values from one section. Nothing in the file is believed: sizes are compared with what is left before memory
/// is asked for, and enumerations, flags and ids with what they may be.
class Reader {
public:
    /// `file`: the whole of it. `where`: its path, for messages.
    Reader(std::span<const std::byte> file, Range section, const std::string& where, Counts counts = {})
        : file_(file.first(section.offset + section.bytes)), at_(section.offset), where_(where), counts_(counts) {}

    template<class T>
    void operator()(T& value) {
        if constexpr (Record<T>) {
            fields(*this, value);
        } else if constexpr (std::same_as<T, bool>) {
            value = number(1) != 0;
        } else if constexpr (std::is_enum_v<T>) {
            const auto index = read<uint32_t>();
            check(exists(index, T{}), "a value that does not exist");
            value = static_cast<T>(index);
        } else {
            static_assert(Plain<T>);
            copy(&value, sizeof(T));
        }
    }
    void operator()(std::string& text) {
        text.resize(count(1));
        copy(text.data(), text.size());
    }
    template<class T>
    void operator()(std::vector<T>& values) {
        if constexpr (Plain<T>) {
            values.resize(count(sizeof(T), alignof(T)));
            copy(values.data(), values.size() * sizeof(T));
        } else {
            values.clear();
            for (size_t n = count(1); n > 0; --n) (*this)(values.emplace_back()); // ends with the data
        }
    }
    template<class T>
    void operator()(std::optional<T>& value) {
        if (read<bool>()) (*this)(value.emplace());
    }

    template<class T>
    T read() {
        T value{};
        (*this)(value);
        return value;
    }
    /// A number of things, each of at least `bytes`.
    size_t count(size_t bytes, size_t alignment = 1) {
        const auto n = read<uint64_t>();
        const size_t padding = (alignment - at_ % alignment) % alignment;
        check(padding <= left(), "an array beyond its section");
        at_ += padding;
        check(n <= left() / bytes, "an array beyond its section");
        return n;
    }
    const Counts& counts() const { return counts_; }
    void check(bool good, const char* what) const {
        if (!good) throw damaged(what, where_);
    }

private:
    size_t left() const { return file_.size() - at_; }
    uint8_t number(uint8_t most) {
        const auto value = read<uint8_t>();
        check(value <= most, "a value that does not exist");
        return value;
    }
    void copy(void* to, size_t size) {
        check(size <= left(), "a section that ends too early");
        if (size > 0) std::memcpy(to, file_.data() + at_, size);
        at_ += size;
    }

    static bool isId(uint32_t id, uint32_t count) { return id == ~0u || id < count; }
    bool exists(uint32_t id, MeshId) const { return isId(id, counts_.meshes); }
    bool exists(uint32_t id, MaterialId) const { return isId(id, counts_.materials); }
    bool exists(uint32_t id, TextureId) const { return isId(id, counts_.textures); }
    static bool exists(uint32_t kind, LightKind) { return kind <= static_cast<uint32_t>(LightKind::Dome); }
    static bool exists(uint32_t wrap, Wrap) { return wrap <= static_cast<uint32_t>(Wrap::Black); }
    static bool exists(uint32_t blend, Blend) { return blend <= static_cast<uint32_t>(Blend::Rigid); }
    static bool exists(uint32_t target, Target) { return target <= static_cast<uint32_t>(Target::MeshPoints); }

    std::span<const std::byte> file_;
    size_t at_;
    const std::string& where_;
    Counts counts_;
};

} // namespace trilume::snapshot
