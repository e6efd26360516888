#include "gpu/mip_chain.h"

#include "core/task_pool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace trilume::gpu {
namespace {

using Texel = std::array<float, 4>;

double linearFromSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

/// Decoding of the 256 codes, and the linear values halfway between neighbouring codes for exact rounding back.
struct SrgbTable {
    std::array<float, 256> linear;
    std::array<float, 255> halfway;
    SrgbTable() {
        for (size_t i = 0; i < 256; ++i) linear[i] = static_cast<float>(linearFromSrgb(static_cast<double>(i) / 255));
        for (size_t i = 0; i < 255; ++i)
            halfway[i] = static_cast<float>(linearFromSrgb((static_cast<double>(i) + 0.5) / 255));
    }
    uint8_t encode(float value) const {
        return static_cast<uint8_t>(std::ranges::upper_bound(halfway, value) - halfway.begin());
    }
};

const SrgbTable& srgbTable() {
    static const SrgbTable table;
    return table;
}

Texel decode(VkFormat format, const std::byte* source) {
    Texel texel;
    if (format == VK_FORMAT_R32G32B32A32_SFLOAT) {
        std::memcpy(texel.data(), source, sizeof texel);
        return texel;
    }
    for (int c = 0; c < 4; ++c) {
        const auto code = static_cast<uint8_t>(source[c]);
        const bool srgb = format == VK_FORMAT_R8G8B8A8_SRGB && c < 3;
        texel[c] = srgb ? srgbTable().linear[code] : static_cast<float>(code) / 255;
    }
    return texel;
}

void encode(VkFormat format, const Texel& texel, std::byte* target) {
    if (format == VK_FORMAT_R32G32B32A32_SFLOAT) {
        std::memcpy(target, texel.data(), sizeof texel);
        return;
    }
    for (int c = 0; c < 4; ++c) {
        const bool srgb = format == VK_FORMAT_R8G8B8A8_SRGB && c < 3;
        target[c] = static_cast<std::byte>(srgb ? srgbTable().encode(texel[c])
                                                : static_cast<uint8_t>(std::lround(texel[c] * 255)));
    }
}

/// The source texels under one target texel along an axis, with the share that each has of it.
struct Taps {
    uint32_t first, count;
    std::array<float, 3> weights; // 2k+1 texels to k: one more than the two of the even case
};

std::vector<Taps> boxTaps(uint32_t sources, uint32_t targets) {
    const double scale = static_cast<double>(sources) / targets;
    std::vector<Taps> taps(targets);
    for (uint32_t i = 0; i < targets; ++i) {
        const double begin = i * scale, end = begin + scale;
        taps[i].first = static_cast<uint32_t>(begin);
        taps[i].count = 0;
        for (uint32_t s = taps[i].first; s < sources && taps[i].count < 3; ++s) {
            const double overlap = std::min(end, s + 1.0) - std::max(begin, static_cast<double>(s));
            if (overlap <= 1e-9) break;
            taps[i].weights[taps[i].count++] = static_cast<float>(overlap / scale);
        }
    }
    return taps;
}

} // namespace

size_t texelBytes(VkFormat format) {
    switch (format) {
    case VK_FORMAT_R8G8B8A8_SRGB:
    case VK_FORMAT_R8G8B8A8_UNORM:
        return 4;
    case VK_FORMAT_R32G32B32A32_SFLOAT:
        return 16;
    default:
        return 0;
    }
}

MipChain buildMipChain(uint32_t width, uint32_t height, VkFormat format, std::span<const std::byte> pixels) {
    const size_t texelSize = texelBytes(format);
    MipChain chain;
    size_t bytes = 0;
    for (uint32_t w = width, h = height;; w = std::max(1u, w / 2), h = std::max(1u, h / 2)) {
        chain.levels.push_back({w, h, bytes});
        bytes += size_t{w} * h * texelSize;
        if (w == 1 && h == 1) break;
    }
    chain.texels.resize(bytes);
    std::ranges::copy(pixels, chain.texels.begin());

    std::vector<Texel> finer, coarser; // linear values: rounding to the format does not add up along the chain
    for (size_t level = 1; level < chain.levels.size(); ++level) {
        const MipLevel from = chain.levels[level - 1], to = chain.levels[level];
        const std::vector<Taps> columns = boxTaps(from.width, to.width), rows = boxTaps(from.height, to.height);
        const auto read = [&](uint32_t x, uint32_t y) {
            const size_t index = size_t{y} * from.width + x;
            return level == 1 ? decode(format, pixels.data() + index * texelSize) : finer[index];
        };
        coarser.resize(size_t{to.width} * to.height);
        TaskPool::shared().parallelFor(to.height, 16, [&](size_t begin, size_t end) {
            for (size_t y = begin; y < end; ++y)
                for (uint32_t x = 0; x < to.width; ++x) {
                    Texel sum{};
                    for (uint32_t j = 0; j < rows[y].count; ++j)
                        for (uint32_t i = 0; i < columns[x].count; ++i) {
                            const Texel texel = read(columns[x].first + i, rows[y].first + j);
                            const float weight = rows[y].weights[j] * columns[x].weights[i];
                            for (int c = 0; c < 4; ++c) sum[c] += weight * texel[c];
                        }
                    const size_t index = y * to.width + x;
                    coarser[index] = sum;
                    encode(format, sum, chain.texels.data() + to.offset + index * texelSize);
                }
        });
        finer.swap(coarser);
    }
    return chain;
}

} // namespace trilume::gpu
