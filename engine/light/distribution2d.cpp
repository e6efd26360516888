#include "light/distribution2d.h"

#include "core/task_pool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace trilume {
namespace {

constexpr uint32_t kMaxWidth = 1024, kMaxHeight = 512;
// The least share of a mean cell that a cell which emits at all gets, in its row and as a row: keeps the steps of float
// cumulative sums (spacing 6e-8) far above rounding.
constexpr double kLeastShare = 1.0 / 64;

float luminance(glm::vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

class Reader {
public:
    explicit Reader(const Texture& texture) : texture_(texture) {
        for (int i = 0; i < 256; ++i) {
            const float v = float(i) / 255.0f;
            decode_[i] = !texture.srgb ? v : v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
        }
    }
    /// Linear colour; row 0 is the bottom.
    glm::vec3 operator()(uint32_t x, uint32_t row) const {
        const size_t texel = 4 * (size_t(texture_.height - 1 - row) * texture_.width + x);
        if (texture_.rgba32f.empty()) {
            const uint8_t* p = &texture_.rgba8[texel];
            return {decode_[p[0]], decode_[p[1]], decode_[p[2]]};
        }
        const float* p = &texture_.rgba32f[texel];
        return {sane(p[0]), sane(p[1]), sane(p[2])};
    }

private:
    static float sane(float v) { return std::isfinite(v) && v > 0 ? v : 0; }
    const Texture& texture_;
    std::array<float, 256> decode_;
};

uint32_t neighbour(uint32_t i, int step, uint32_t count, bool wraps) {
    const int64_t at = int64_t(i) + step;
    if (at >= 0 && at < int64_t(count)) return uint32_t(at);
    return wraps ? (at < 0 ? count - 1 : 0) : i;
}

/// How texel i of `texels` spreads over `cells` <= texels: `share` of it to `first`, the rest to the next.
struct Overlap {
    uint32_t first;
    double share;
    Overlap(uint32_t i, uint32_t texels, uint32_t cells) : first(uint32_t(uint64_t(i) * cells / texels)) {
        const double inside = double(uint64_t(first + 1) * texels - uint64_t(i) * cells);
        share = std::min(1.0, inside / cells);
    }
};

// Average of a linear interpolation over one texel: this much of itself and of each neighbour.
constexpr std::array<double, 3> kTent{1.0 / 8, 6.0 / 8, 1.0 / 8};

/// Cumulative sum from 0 to 1 of weights with kLeastShare applied; all alike when they are all 0. Returns their sum.
double accumulate(const double* weights, uint32_t count, float* cumulative) {
    double total = 0;
    for (uint32_t i = 0; i < count; ++i) total += weights[i];
    const double least = kLeastShare * total / count;
    const auto share = [&](uint32_t i) {
        return !(total > 0) ? 1.0 : weights[i] > 0 ? std::max(weights[i], least) : 0.0;
    };
    double shares = 0, sum = 0;
    for (uint32_t i = 0; i < count; ++i) shares += share(i);
    cumulative[0] = 0;
    for (uint32_t i = 0; i < count; ++i) {
        sum += share(i); // in the same order as above, so the end is exactly 1
        cumulative[i + 1] = float(sum / shares);
    }
    return total;
}

} // namespace

TextureDistribution buildTextureDistribution(const Texture& texture, TextureDomain domain) {
    const uint32_t width = texture.width, height = texture.height;
    const bool latLong = domain == TextureDomain::LatLong;
    const bool wrapsS = latLong || texture.wrapS == Wrap::Repeat, wrapsT = !latLong && texture.wrapT == Wrap::Repeat;
    TextureDistribution d;
    d.width = std::min(width, kMaxWidth);
    d.height = std::min(height, kMaxHeight);
    d.marginal.resize(d.height + 1);
    d.conditional.resize(size_t(d.height) * (d.width + 1));
    d.density.resize(size_t(d.height) * d.width);

    const Reader read(texture);
    const auto sineAt = [&](double v) { return latLong ? std::sin((v - 0.5) * std::numbers::pi) : v; };
    std::vector<double> rowWeights(d.height);
    std::vector<glm::dvec3> rowColors(d.height, glm::dvec3(0));

    const auto buildRow = [&](uint32_t row) {
        // The texel rows that this row of cells covers, and those that filtering mixes in.
        const uint32_t begin = uint32_t(uint64_t(row) * height / d.height);
        const uint32_t end = uint32_t((uint64_t(row + 1) * height + d.height - 1) / d.height);
        struct Share {
            double covered = 0, filtered = 0;
        };
        std::map<uint32_t, Share> texelRows;
        double covered = 0;
        for (uint32_t y = begin; y < end; ++y) {
            const Overlap overlap(y, height, d.height);
            const double share = overlap.first == row ? overlap.share : 1 - overlap.share;
            covered += share;
            texelRows[y].covered = share;
            for (int step = -1; step <= 1; ++step) {
                texelRows[neighbour(y, step, height, wrapsT)].filtered += share * kTent[step + 1];
            }
        }

        std::vector<double> cells(d.width, 0.0), line(width);
        glm::dvec3 color(0);
        for (const auto& [y, share] : texelRows) {
            for (uint32_t x = 0; x < width; ++x) {
                const glm::vec3 c = read(x, y);
                line[x] = share.filtered * luminance(c);
                color += share.covered * glm::dvec3(c);
            }
            for (uint32_t x = 0; x < width; ++x) {
                const double value = kTent[0] * line[neighbour(x, -1, width, wrapsS)] + kTent[1] * line[x] +
                                     kTent[2] * line[neighbour(x, 1, width, wrapsS)];
                const Overlap across(x, width, d.width);
                cells[across.first] += across.share * value;
                if (across.share < 1) cells[across.first + 1] += (1 - across.share) * value;
            }
        }
        const double measure = sineAt(double(row + 1) / d.height) - sineAt(double(row) / d.height);
        rowColors[row] = color / (covered * width) * measure;
        rowWeights[row] =
            accumulate(cells.data(), d.width, &d.conditional[size_t(row) * (d.width + 1)]) / covered * measure;
    };
    TaskPool::shared().parallelFor(d.height, 8, [&](size_t begin, size_t end) {
        for (size_t row = begin; row < end; ++row) buildRow(uint32_t(row));
    });

    glm::dvec3 mean(0);
    double brightness = 0;
    for (uint32_t row = 0; row < d.height; ++row) {
        mean += rowColors[row];
        brightness += rowWeights[row];
    }
    d.mean = glm::vec3(mean / (sineAt(1) - sineAt(0)));
    if (!(brightness > 0)) {
        for (uint32_t row = 0; row < d.height; ++row) {
            rowWeights[row] = sineAt(double(row + 1) / d.height) - sineAt(double(row) / d.height);
        }
    }
    accumulate(rowWeights.data(), d.height, d.marginal.data());
    for (uint32_t row = 0; row < d.height; ++row) {
        const double rowShare = (double(d.marginal[row + 1]) - d.marginal[row]) * d.height;
        const float* sums = &d.conditional[size_t(row) * (d.width + 1)];
        for (uint32_t x = 0; x < d.width; ++x) {
            d.density[size_t(row) * d.width + x] = float((double(sums[x + 1]) - sums[x]) * d.width * rowShare);
        }
    }
    return d;
}

} // namespace trilume
