// Importance sampling of an emission texture by inversion of its piecewise-constant density (shared::Distribution).
#ifndef TL_LIB_LIGHT_DISTRIBUTION_GLSL
#define TL_LIB_LIGHT_DISTRIBUTION_GLSL

#include "lib/math.glsl"
#include "shared/light.h"

// Largest i in [0, count) with cdf[first + i] <= u.
uint findInterval(floatRef cdf, uint first, uint count, float u) {
    uint low = 0u, high = count;
    while (high - low > 1u) {
        const uint middle = (low + high) / 2u;
        if (cdf.v[first + middle] <= u) low = middle;
        else high = middle;
    }
    return low;
}

// Where in [i, i + 1] the cumulative sum reaches u, divided by count.
float invertInterval(floatRef cdf, uint first, uint i, uint count, float u) {
    const float begin = cdf.v[first + i], end = cdf.v[first + i + 1u];
    return min((float(i) + saturate(safeDivide(u - begin, end - begin))) / float(count), kOneMinusEpsilon);
}

// Point of [0,1)^2; its density is distributionPdf.
vec2 sampleDistribution(Distribution d, vec2 u) {
    const uint row = findInterval(d.marginal, 0u, d.height, u.y);
    const uint first = row * (d.width + 1u);
    const uint column = findInterval(d.conditional, first, d.width, u.x);
    return vec2(invertInterval(d.conditional, first, column, d.width, u.x),
                invertInterval(d.marginal, 0u, row, d.height, u.y));
}

// Density with respect to du dv.
float distributionPdf(Distribution d, vec2 uv) {
    const uvec2 cell = min(uvec2(max(uv, 0.0) * vec2(d.width, d.height)), uvec2(d.width, d.height) - 1u);
    return d.density.v[cell.y * d.width + cell.x];
}

#endif
