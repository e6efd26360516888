#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace trilume::test {

/// Upper tail of the chi-squared distribution, by Wilson and Hilferty's cube-root normal approximation.
inline double chiSquaredTail(double statistic, double degrees) {
    const double variance = 2 / (9 * degrees);
    return 0.5 * std::erfc((std::cbrt(statistic / degrees) - (1 - variance)) / std::sqrt(2 * variance));
}

/// Two-sided tail of the standard normal distribution.
inline double normalTail(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

/// The significance to ask of each of `tests` independent tests so that all together fail by chance with probability
/// `overall` (Sidak).
inline double sidak(double overall, double tests) { return -std::expm1(std::log1p(-overall) / tests); }

/// Probability that counts as far from their expectation as these arise by chance (Pearson). Cells that expect fewer
/// than 5 are pooled; one that expects none and got some gives 0. The sums of both agree up to rounding.
inline double chiSquaredTest(const std::vector<double>& observed, const std::vector<double>& expected) {
    double statistic = 0, pooledObserved = 0, pooledExpected = 0, cells = 0;
    const auto add = [&](double o, double e) {
        statistic += (o - e) * (o - e) / e;
        ++cells;
    };
    for (size_t i = 0; i < observed.size(); ++i) {
        if (expected[i] >= 5) {
            add(observed[i], expected[i]);
        } else {
            pooledObserved += observed[i];
            pooledExpected += expected[i];
        }
    }
    if (pooledExpected >= 5)
        add(pooledObserved, pooledExpected);
    else if (pooledObserved > pooledExpected + 5 * std::sqrt(pooledExpected) + 5)
        return 0;
    return cells > 1 ? chiSquaredTail(statistic, cells - 1) : 1;
}

} // namespace trilume::test
