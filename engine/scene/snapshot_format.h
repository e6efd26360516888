#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// How a .tlscene lies in the file: README.md.
namespace trilume::snapshot {

inline constexpr std::array<char, 8> kMagic{'T', 'L', 'S', 'C', 'E', 'N', 'E', '\n'};
inline constexpr uint32_t kByteOrder = 0x01020304;
inline constexpr uint32_t kVersion = 2; ///< grows with every change of what is written
inline constexpr size_t kAlignment = 64;

enum class Section : uint32_t { Info, Textures, Materials, Meshes, Entities, Components, Tracks };
inline constexpr size_t kSections = 7;

struct Range {
    uint64_t offset, bytes;
};

struct Header {
    std::array<char, 8> magic;
    uint32_t byteOrder, version;
    uint64_t fileBytes;
    uint64_t checksum; ///< of all that follows it
    std::array<Range, kSections> sections;
};
inline constexpr size_t kUnchecked = offsetof(Header, sections);

/// What a track changes. Applied in this order.
enum class Target : uint32_t {
    Existence,
    LocalTransform,
    Visibility,
    MeshInstance,
    SphereInstance,
    Light,
    Camera,
    Material,
    MeshTopology,
    MeshPoints
};

/// Of a multiple of 8 bytes. Each word goes through bijections, so a change within one word never goes unseen.
uint64_t checksum(std::span<const std::byte> bytes);

} // namespace trilume::snapshot
