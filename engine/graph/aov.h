#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace trilume::graph {

/// A picture beside the beauty image: which planes it is averaged from, by the end of their names.
struct Aov {
    std::string_view name;
    std::string_view suffix; ///< of the planes summed into it
    uint32_t channels;
    bool guide; ///< of the first surface, by the visibility node, rather than light
};

/// Bit i of the parameter `view.aovs` asks for entry i. `color` (the picture) and `variance` come from the sums and
/// need no plane.
inline constexpr std::array<Aov, 8> kAovs{{
    {"direct", ".direct", 3, false},
    {"indirect", ".indirect", 3, false},
    {"caustic", ".caustic", 3, false},
    {"emission", ".emission", 3, false},
    {"albedo", ".albedo", 3, true},
    {"normal", ".normal", 3, true},
    {"depth", ".depth", 1, true},
    {"motion", ".motion", 2, true},
}};
inline constexpr std::string_view kAovParam = "view.aovs";
inline constexpr std::string_view kColorAov = "color", kVarianceAov = "variance";

/// The entry of kAovs; kAovs.end() when there is none.
constexpr auto findAov(std::string_view name) {
    auto it = kAovs.begin();
    while (it != kAovs.end() && it->name != name) ++it;
    return it;
}
constexpr bool isFromSums(std::string_view name) { return name == kColorAov || name == kVarianceAov; }

} // namespace trilume::graph
