#include "core/display.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trilume {
namespace {

using Rgb = std::array<float, 3>;
using Rows = std::array<Rgb, 3>;

Rgb operator*(const Rows& m, const Rgb& v) {
    Rgb r{};
    for (int i = 0; i < 3; ++i) r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return r;
}

/// Stephen Hill, ACES.hlsl of MJP's BakingLab (2016): sRGB to RRT space, rational fit of RRT and ODT, and back.
Rgb aces(const Rgb& scene) {
    static constexpr Rows kRrtFromSrgb{{{0.59719f, 0.35458f, 0.04823f}, //
                                        {0.07600f, 0.90834f, 0.01566f},
                                        {0.02840f, 0.13383f, 0.83777f}}};
    static constexpr Rows kSrgbFromOdt{{{1.60475f, -0.53108f, -0.07367f}, //
                                        {-0.10208f, 1.10813f, -0.00605f},
                                        {-0.00327f, -0.07276f, 1.07602f}}};
    Rgb v = kRrtFromSrgb * scene;
    for (float& x : v) x = (x * (x + 0.0245786f) - 0.000090537f) / (x * (0.983729f * x + 0.4329510f) + 0.238081f);
    return kSrgbFromOdt * v;
}

/// Benjamin Wrensch, "Minimal AgX Implementation" (2023), after Troy Sobotka: inset, log2 encoding over 16.5 stops,
/// sixth-order fit of the default contrast curve, outset, and from the curve's 2.2 power to linear.
Rgb agx(const Rgb& scene) {
    static constexpr Rows kInset{{{0.842479062253094f, 0.0784335999999992f, 0.0792237451477643f},
                                  {0.0423282422610123f, 0.878468636469772f, 0.0791661274605434f},
                                  {0.0423756549057051f, 0.0784336f, 0.879142973793104f}}};
    static constexpr Rows kOutset{{{1.19687900512017f, -0.0980208811401368f, -0.0990297440797205f},
                                   {-0.0528968517574562f, 1.15190312990417f, -0.0989611768448433f},
                                   {-0.0529716355144438f, -0.0980434501171241f, 1.15107367264116f}}};
    static constexpr float kMinEv = -12.47393f, kMaxEv = 4.026069f;
    Rgb v = kInset * scene;
    for (float& value : v) {
        const float x = (std::clamp(std::log2(value), kMinEv, kMaxEv) - kMinEv) / (kMaxEv - kMinEv);
        const float x2 = x * x, x4 = x2 * x2;
        value =
            15.5f * x4 * x2 - 40.14f * x4 * x + 31.96f * x4 - 6.868f * x2 * x + 0.4298f * x2 + 0.1191f * x - 0.00232f;
    }
    v = kOutset * v;
    for (float& x : v) x = std::pow(std::max(x, 0.0f), 2.2f);
    return v;
}

/// What every tone map shows as full white, and whose square is still finite.
constexpr float kBrightest = 1e15f;

} // namespace

float srgbFromLinear(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f; }

void toDisplay(std::span<float> rgb, double exposure, ToneMap toneMap) {
    const auto scale = static_cast<float>(std::exp2(exposure));
    for (size_t i = 0; i + 2 < rgb.size(); i += 3) {
        Rgb v{};
        for (int c = 0; c < 3; ++c) v[c] = rgb[i + c] > 0 ? std::min(rgb[i + c] * scale, kBrightest) : 0.0f;
        if (toneMap == ToneMap::Aces) v = aces(v);
        if (toneMap == ToneMap::Agx) v = agx(v);
        for (int c = 0; c < 3; ++c) rgb[i + c] = srgbFromLinear(std::clamp(v[c], 0.0f, 1.0f));
    }
}

} // namespace trilume
