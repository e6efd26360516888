#include "core/display.h"

#include "shared/display.h"

#include <cmath>

namespace trilume {

static_assert(static_cast<uint32_t>(ToneMap::None) == shared::kTonemapNone);
static_assert(static_cast<uint32_t>(ToneMap::Aces) == shared::kTonemapAces);
static_assert(static_cast<uint32_t>(ToneMap::Agx) == shared::kTonemapAgx);

float srgbFromLinear(float x) { return shared::srgbEncode(x); }

void toDisplay(std::span<float> rgb, double exposure, ToneMap toneMap) {
    const auto scale = static_cast<float>(std::exp2(exposure));
    for (size_t i = 0; i + 2 < rgb.size(); i += 3) {
        const glm::vec3 v =
            shared::displayFromScene({rgb[i], rgb[i + 1], rgb[i + 2]}, scale, static_cast<uint32_t>(toneMap));
        for (int c = 0; c < 3; ++c) rgb[i + c] = v[c];
    }
}

} // namespace trilume
