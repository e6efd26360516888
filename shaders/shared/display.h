// From scene-linear radiance to what a display shows; the same functions for pictures on files (C++) and on screens
// (GLSL).
#ifndef TL_SHARED_DISPLAY_H
#define TL_SHARED_DISPLAY_H

#include "shared/types.h"

TL_BEGIN

#ifdef __cplusplus
using glm::clamp;
using glm::log2;
using glm::max;
using glm::min;
using glm::pow;
#endif

TL_CONST uint kTonemapNone = 0; // cut off at 1
TL_CONST uint kTonemapAces = 1;
TL_CONST uint kTonemapAgx = 2;

// What every tone map shows as full white, and whose square is still finite.
TL_CONST float kDisplayBrightest = 1e15f;

// ACES RRT and sRGB ODT in the rational fit of Stephen Hill (2016, ACES.hlsl of MJP's BakingLab): sRGB to RRT space,
// the curve, and back. Crushes blacks a little; highlights desaturate.
TL_INLINE vec3 tonemapAces(vec3 scene) {
    const mat3 rrtFromSrgb =
        mat3(0.59719f, 0.07600f, 0.02840f, 0.35458f, 0.90834f, 0.13383f, 0.04823f, 0.01566f, 0.83777f);
    const mat3 srgbFromOdt =
        mat3(1.60475f, -0.10208f, -0.00327f, -0.53108f, 1.10813f, -0.07276f, -0.07367f, -0.00605f, 1.07602f);
    const vec3 v = rrtFromSrgb * scene;
    const vec3 a = v * (v + vec3(0.0245786f)) - vec3(0.000090537f);
    const vec3 b = v * (v * 0.983729f + vec3(0.4329510f)) + vec3(0.238081f);
    return srgbFromOdt * (a / b);
}

// AgX by Troy Sobotka (2022), base look, in Benjamin Wrensch's "Minimal AgX Implementation" (2023): inset, log2
// encoding over 16.5 stops, sixth-order fit of the contrast curve, outset, and from the curve's 2.2 power to linear.
TL_INLINE vec3 tonemapAgx(vec3 scene) {
    const mat3 inset =
        mat3(0.842479062253094f, 0.0423282422610123f, 0.0423756549057051f, 0.0784335999999992f, 0.878468636469772f,
             0.0784336f, 0.0792237451477643f, 0.0791661274605434f, 0.879142973793104f);
    const mat3 outset =
        mat3(1.19687900512017f, -0.0528968517574562f, -0.0529716355144438f, -0.0980208811401368f, 1.15190312990417f,
             -0.0980434501171241f, -0.0990297440797205f, -0.0989611768448433f, 1.15107367264116f);
    const float minEv = -12.47393f;
    const float maxEv = 4.026069f;
    // The floor keeps the logarithm finite; it lies below minEv.
    const vec3 x =
        (clamp(log2(max(inset * scene, vec3(1e-10f))), vec3(minEv), vec3(maxEv)) - vec3(minEv)) / (maxEv - minEv);
    const vec3 x2 = x * x;
    const vec3 x4 = x2 * x2;
    const vec3 curve =
        x4 * x2 * 15.5f - x4 * x * 40.14f + x4 * 31.96f - x2 * x * 6.868f + x2 * 0.4298f + x * 0.1191f - vec3(0.00232f);
    return pow(max(outset * curve, vec3(0.0f)), vec3(2.2f));
}

// IEC 61966-2-1: display-linear 0..1 to encoded 0..1.
TL_INLINE float srgbEncode(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * pow(x, 1.0f / 2.4f) - 0.055f; }

// `exposure` is a factor. NaN and what is below 0 become 0.
TL_INLINE vec3 displayFromScene(vec3 scene, float exposure, uint tonemap) {
    vec3 v = vec3(scene.x > 0.0f ? scene.x : 0.0f, scene.y > 0.0f ? scene.y : 0.0f, scene.z > 0.0f ? scene.z : 0.0f);
    v = min(v * min(exposure, kDisplayBrightest), vec3(kDisplayBrightest));
    if (tonemap == kTonemapAces) v = tonemapAces(v);
    if (tonemap == kTonemapAgx) v = tonemapAgx(v);
    v = clamp(v, vec3(0.0f), vec3(1.0f));
    return vec3(srgbEncode(v.x), srgbEncode(v.y), srgbEncode(v.z));
}

TL_END

#endif
