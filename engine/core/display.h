#pragma once

#include <span>

namespace trilume {

/// How scene-linear Rec. 709 radiance becomes display-linear Rec. 709 in 0..1.
enum class ToneMap {
    None, ///< cut off at 1
    Aces, ///< ACES RRT and sRGB ODT, fitted by Stephen Hill (2016); blacks crushed a little, highlights desaturate
    Agx,  ///< AgX by Troy Sobotka (2022), base look, in Benjamin Wrensch's polynomial approximation (2023)
};

/// From scene-linear to sRGB-encoded values in 0..1, in place: times 2^exposure, tone map, IEC 61966-2-1 encoding.
/// `rgb` holds three values per pixel. NaN and what is below 0 become 0.
void toDisplay(std::span<float> rgb, double exposure, ToneMap toneMap);

/// IEC 61966-2-1: display-linear 0..1 to encoded 0..1.
float srgbFromLinear(float x);

} // namespace trilume
