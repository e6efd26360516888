#include "render/bsdf_tables.h"

#include "shared/bsdf_tables.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

namespace trilume {
namespace {

using namespace shared;

#include "render/bsdf_tables_data.inc"

static_assert(std::size(kGgx[0]) == kGgxSize * kGgxSize);
static_assert(std::size(kDielectricLost) == kDielectricEtas * kDielectricSize * kDielectricSize);

/// 2 * integral over mu in [0, 1] of mu g(mu)^power, for g piecewise linear in sqrt(mu), as the shaders interpolate:
/// the energy given back then adds up exactly. Gauss-Legendre with 3 nodes per piece is exact up to power 2.
template<class T>
double cosineMean(std::span<const T> row, int power) {
    constexpr double kNodes[] = {0.1127016653792583, 0.5, 0.8872983346207417};
    constexpr double kWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    const double step = 1.0 / double(row.size() - 1), scale = 1.0 / std::numeric_limits<T>::max();
    double sum = 0;
    for (size_t i = 0; i + 1 < row.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const double x = (double(i) + kNodes[k]) * step; // mu = x^2, so 2 mu dmu = 4 x^3 dx
            const double g = scale * std::lerp(double(row[i]), double(row[i + 1]), kNodes[k]);
            sum += kWeights[k] * step * 4 * x * x * x * std::pow(g, power);
        }
    return sum;
}

uint32_t bits(double value) { return std::bit_cast<uint32_t>(float(value)); }

} // namespace

std::vector<uint32_t> bsdfTables() {
    std::vector<uint32_t> words;
    words.reserve(kBsdfTableWords);

    for (const size_t pair : {0, 2})
        for (size_t i = 0; i < std::size(kGgx[0]); ++i)
            words.push_back(kGgx[pair][i] | uint32_t(kGgx[pair + 1][i]) << 16);
    for (size_t y = 0; y < kGgxSize; ++y) {
        const auto mean = [&](size_t table, int power) {
            return cosineMean(std::span(kGgx[table]).subspan(y * kGgxSize, kGgxSize), power);
        };
        for (size_t table = 0; table < 4; ++table) words.push_back(bits(mean(table, 1)));
        words.push_back(bits(std::sqrt(std::max(mean(1, 2) - mean(1, 1) * mean(1, 1), 0.0))));
    }

    const size_t last = kDielectricSize - 1;
    for (size_t z = 0; z < kDielectricEtas; ++z)
        for (size_t y = 0; y < kDielectricSize; ++y)
            for (size_t x = 0; x < kDielectricSize; ++x) {
                const auto entry = [&](size_t column, size_t row) {
                    return uint32_t(kDielectricLost[(z * kDielectricSize + std::min(row, last)) * kDielectricSize +
                                                    std::min(column, last)]);
                };
                words.push_back(entry(x, y) | entry(x + 1, y) << 8 | entry(x, y + 1) << 16 | entry(x + 1, y + 1) << 24);
            }
    for (size_t row = 0; row < kDielectricEtas * kDielectricSize; ++row)
        words.push_back(
            bits(cosineMean(std::span(kDielectricLost).subspan(row * kDielectricSize, kDielectricSize), 1)));
    return words;
}

} // namespace trilume
