// Layout of the table of microfacet energies that the BSDF library reads (shaders/lib/bsdf/tables.glsl) and
// trilume::bsdfTables fills. Axes: x = sqrt(cos theta) over [0, 1], y = perceptual roughness over [0, 1], and for
// dielectrics z = cbrt(2 (eta - 1) / (eta + 1)) over [-1, 1], eta being the index beyond the surface over the one
// before it.
#ifndef TL_SHARED_BSDF_TABLES_H
#define TL_SHARED_BSDF_TABLES_H

#include "shared/types.h"

TL_BEGIN

// Reflection. Word [y][x]: unorm16 pair, energy lost by single scattering with Fresnel factor 1; energy reflected with
// factor (1 - cos)^5.
TL_CONST uint kGgxSize = 32;
// Per y two floats: cosine-weighted means.
TL_CONST uint kGgxMeanOffset = kGgxSize * kGgxSize;
TL_CONST uint kGgxMeans = 2;

// Reflection below a coat, z = the coat's perceptual roughness. Word [z][y][x]: unorm16 pair of integrals of
// max(0, w(wi) - w(wo)) over the reflected light with Fresnel factor 1 - (1 - cos)^5 and (1 - cos)^5, w being the
// second of the pair above for the coat: what a coat takes from the light reflected below it, beyond what it takes from
// a mirror.
TL_CONST uint kCoatedOffset = kGgxMeanOffset + kGgxMeans * kGgxSize;
TL_CONST uint kCoatedSize = 16;
TL_CONST uint kCoatRoughnesses = 8;
// Per [z][y] four floats: cosine-weighted means, and covariances of w with the pair above.
TL_CONST uint kCoatedMeanOffset = kCoatedOffset + kCoatRoughnesses * kCoatedSize * kCoatedSize;

// Dielectrics. Word [z][y][x]: energy lost at (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) as unorm8, so that one
// load serves one bilinear lookup.
TL_CONST uint kDielectricOffset = kCoatedMeanOffset + 4 * kCoatRoughnesses * kCoatedSize;
TL_CONST uint kDielectricSize = 24;
TL_CONST uint kDielectricEtas = 25;
// Float [z][y]: cosine-weighted mean.
TL_CONST uint kDielectricMeanOffset = kDielectricOffset + kDielectricEtas * kDielectricSize * kDielectricSize;
TL_CONST uint kBsdfTableWords = kDielectricMeanOffset + kDielectricEtas * kDielectricSize;

TL_END

#endif
