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

#include "render/bsdf_tables_data.inc"

/// A function of the cosine: its values in equal steps of sqrt(cosine) over [0, 1], linear in between as in the
/// shaders.
using Row = std::vector<double>;

/// Row `y` of a table; rows in between are linear too.
template<class T>
Row rowOf(std::span<const T> table, size_t size, double y) {
    const size_t lower = std::min(size_t(y), table.size() / size - 2);
    Row row(size);
    for (size_t x = 0; x < size; ++x)
        row[x] = std::lerp(double(table[lower * size + x]), double(table[(lower + 1) * size + x]), y - double(lower)) /
                 std::numeric_limits<T>::max();
    return row;
}

/// 2 * integral over mu in [0, 1] of mu g(mu) h(mu): the energy given back adds up exactly. Gauss-Legendre with 3 nodes
/// per piece is exact.
double cosineMean(const Row& g, const Row& h = {}) {
    constexpr double kNodes[] = {0.1127016653792583, 0.5, 0.8872983346207417};
    constexpr double kWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    const double step = 1.0 / double(g.size() - 1);
    double sum = 0;
    for (size_t i = 0; i + 1 < g.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const double x = (double(i) + kNodes[k]) * step; // mu = x^2, so 2 mu dmu = 4 x^3 dx
            const auto at = [&](const Row& row) { return row.empty() ? 1 : std::lerp(row[i], row[i + 1], kNodes[k]); };
            sum += kWeights[k] * step * 4 * x * x * x * at(g) * at(h);
        }
    return sum;
}

double covariance(const Row& g, const Row& h) { return cosineMean(g, h) - cosineMean(g) * cosineMean(h); }

uint32_t bits(double value) { return std::bit_cast<uint32_t>(float(value)); }

} // namespace

std::vector<uint32_t> bsdfTables() {
    using namespace shared;
    static_assert(std::size(kGgx[0]) == kGgxSize * kGgxSize);
    static_assert(std::size(kCoated[0]) == kCoatRoughnesses * kCoatedSize * kCoatedSize);
    static_assert(std::size(kDielectricLost) == kDielectricEtas * kDielectricSize * kDielectricSize);

    std::vector<uint32_t> words;
    words.reserve(kBsdfTableWords);

    for (size_t i = 0; i < std::size(kGgx[0]); ++i) words.push_back(kGgx[0][i] | uint32_t(kGgx[1][i]) << 16);
    const auto ggx = [](size_t which, double y) { return rowOf<uint16_t>(kGgx[which], kGgxSize, y); };
    for (size_t y = 0; y < kGgxSize; ++y)
        for (size_t which = 0; which < 2; ++which) words.push_back(bits(cosineMean(ggx(which, double(y)))));

    for (size_t i = 0; i < std::size(kCoated[0]); ++i) words.push_back(kCoated[0][i] | uint32_t(kCoated[1][i]) << 16);
    for (size_t row = 0; row < size_t{kCoatRoughnesses} * kCoatedSize; ++row) {
        const auto roughness = [&](size_t node, size_t nodes) {
            return double(node) / double(nodes - 1) * (kGgxSize - 1);
        };
        const Row coat = ggx(1, roughness(row / kCoatedSize, kCoatRoughnesses));
        for (const auto& table : kCoated)
            words.push_back(bits(cosineMean(rowOf<uint16_t>(table, kCoatedSize, double(row)))));
        for (size_t which = 0; which < 2; ++which)
            words.push_back(bits(covariance(coat, ggx(which, roughness(row % kCoatedSize, kCoatedSize)))));
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
    for (size_t row = 0; row < size_t{kDielectricEtas} * kDielectricSize; ++row)
        words.push_back(bits(cosineMean(rowOf<uint8_t>(kDielectricLost, kDielectricSize, double(row)))));
    return words;
}

} // namespace trilume
