#include "scene/snapshot_format.h"

#include <bit>
#include <cstring>

namespace trilume::snapshot {
namespace {

/// A bijection of `lane` for every word, and of the word for every lane: xor, multiplication by an odd number,
/// rotation.
uint64_t mix(uint64_t lane, uint64_t word) { return std::rotl((lane ^ word) * 0x9e3779b97f4a7c15ull, 29); }

} // namespace

uint64_t checksum(std::span<const std::byte> bytes) {
    // Four lanes, so that the multiplications overlap.
    std::array<uint64_t, 4> lanes{1, 2, 3, 4};
    size_t at = 0;
    for (; at + sizeof(lanes) <= bytes.size(); at += sizeof(lanes)) {
        std::array<uint64_t, 4> words;
        std::memcpy(words.data(), bytes.data() + at, sizeof(words));
        for (size_t i = 0; i < 4; ++i) lanes[i] = mix(lanes[i], words[i]);
    }
    for (; at + 8 <= bytes.size(); at += 8) {
        uint64_t word = 0;
        std::memcpy(&word, bytes.data() + at, sizeof(word));
        lanes[0] = mix(lanes[0], word);
    }
    uint64_t sum = bytes.size();
    for (const uint64_t lane : lanes) sum = mix(sum, lane);
    return sum;
}

} // namespace trilume::snapshot
