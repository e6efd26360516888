// Parts of the gpu module that need no device.
#include "gpu/adapter.h"
#include "gpu/mip_chain.h"
#include "gpu/range_allocator.h"

#include "core/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace trilume;
using namespace trilume::gpu;

namespace {

// ---- RangeAllocator --------------------------------------------------------------------------------

TEST(RangeAllocator, rangesAreAlignedDisjointAndComeBack) {
    constexpr uint64_t kSize = 10'000;
    RangeAllocator ranges(kSize);
    struct Taken {
        uint64_t offset, size;
    };
    std::vector<Taken> taken;
    std::vector<bool> used(kSize);
    std::mt19937 random(1);
    for (int step = 0; step < 20'000; ++step) {
        if (taken.empty() || random() % 2) {
            const uint64_t size = 1 + random() % 300, alignment = 1ull << random() % 8;
            const auto offset = ranges.allocate(size, alignment);
            if (!offset) continue;
            ASSERT_EQ(*offset % alignment, 0u);
            ASSERT_LE(*offset + size, kSize);
            for (uint64_t i = *offset; i < *offset + size; ++i) {
                ASSERT_FALSE(used[i]);
                used[i] = true;
            }
            taken.push_back({*offset, size});
        } else {
            std::swap(taken[random() % taken.size()], taken.back());
            ranges.release(taken.back().offset, taken.back().size);
            for (uint64_t i = 0; i < taken.back().size; ++i) used[taken.back().offset + i] = false;
            taken.pop_back();
        }
        ASSERT_EQ(ranges.empty(), taken.empty());
    }
    for (const Taken& range : taken) ranges.release(range.offset, range.size);
    EXPECT_TRUE(ranges.empty());
    EXPECT_EQ(ranges.allocate(kSize, 1), 0u);
}

TEST(RangeAllocator, refusesWhatDoesNotFit) {
    RangeAllocator ranges(100);
    EXPECT_FALSE(ranges.allocate(101, 1));
    EXPECT_EQ(ranges.allocate(1, 1), 0u);
    EXPECT_FALSE(ranges.allocate(50, 64)) << "the padding before 64 leaves 36";
    EXPECT_EQ(ranges.allocate(36, 64), 64u);
    EXPECT_EQ(ranges.allocate(63, 1), 1u) << "the padding itself is still free";
}

// ---- Choice of a device ----------------------------------------------------------------------------

DeviceInfo deviceOf(uint32_t index, const char* name, const char* type, const char* missing = "") {
    return {.index = index, .name = name, .driver = "", .type = type, .rayQuery = false, .missing = missing};
}

TEST(ChooseDevice, autoPrefersDiscreteAndSkipsTheUnfit) {
    const std::vector<DeviceInfo> devices = {deviceOf(0, "llvmpipe", "cpu"), deviceOf(1, "Iris", "integrated"),
                                             deviceOf(2, "Old", "discrete", "Vulkan 1.3"),
                                             deviceOf(3, "RTX", "discrete")};
    EXPECT_EQ(chooseDevice(devices, "auto"), 3u);
    EXPECT_EQ(chooseDevice({devices[0], devices[1], devices[2]}, "auto"), 1u);
    EXPECT_EQ(chooseDevice(devices, "0"), 0u);
    EXPECT_EQ(chooseDevice(devices, "rtx"), 3u);
    EXPECT_EQ(chooseDevice(devices, "LLVM"), 0u);
}

TEST(ChooseDevice, refusalsSayWhy) {
    const std::vector<DeviceInfo> devices = {deviceOf(0, "Old", "discrete", "timelineSemaphore")};
    for (const char* choice : {"auto", "0", "old"}) {
        try {
            chooseDevice(devices, choice);
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::Input);
            EXPECT_NE(error.problem().find("timelineSemaphore"), std::string::npos);
            EXPECT_EQ(error.where(), "Old");
        }
    }
    EXPECT_THROW(chooseDevice(devices, "1"), Error);
    EXPECT_THROW(chooseDevice(devices, "0x"), Error);
    EXPECT_THROW(chooseDevice({}, "auto"), Error);
}

// ---- MipChain --------------------------------------------------------------------------------------

TEST(MipChain, levelsHalveDownToOne) {
    const std::vector<uint8_t> texels(5 * 300 * 4);
    const MipChain chain = buildMipChain(5, 300, VK_FORMAT_R8G8B8A8_UNORM, std::as_bytes(std::span(texels)));
    ASSERT_EQ(chain.levels.size(), 9u);
    EXPECT_EQ(chain.levels[1].width, 2u);
    EXPECT_EQ(chain.levels[1].height, 150u);
    EXPECT_EQ(chain.levels[8].width, 1u);
    EXPECT_EQ(chain.levels[8].height, 1u);
    EXPECT_EQ(chain.texels.size(), chain.levels[8].offset + 4);
}

TEST(MipChain, oddSizesKeepTheMean) {
    for (const auto& [width, height] : {std::pair{3u, 3u}, {5u, 1u}, {7u, 13u}, {1u, 31u}, {33u, 17u}}) {
        std::mt19937 random(width * 100 + height);
        std::vector<float> texels(size_t{width} * height * 4);
        double sum = 0;
        for (float& value : texels) sum += value = static_cast<float>(random() % 1000);
        const MipChain chain =
            buildMipChain(width, height, VK_FORMAT_R32G32B32A32_SFLOAT, std::as_bytes(std::span(texels)));
        const auto* last = reinterpret_cast<const float*>(chain.texels.data() + chain.levels.back().offset);
        EXPECT_NEAR((last[0] + last[1] + last[2] + last[3]) / 4.0, sum / static_cast<double>(texels.size()), 1e-3)
            << width << " x " << height;
    }
}

TEST(MipChain, constantColoursStayThemselves) {
    for (const VkFormat format : {VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_R8G8B8A8_UNORM})
        for (int code = 0; code < 256; ++code) {
            const std::vector<uint8_t> texels(3 * 2 * 4, static_cast<uint8_t>(code));
            const MipChain chain = buildMipChain(3, 2, format, std::as_bytes(std::span(texels)));
            for (const std::byte value : chain.texels) ASSERT_EQ(static_cast<int>(value), code) << format;
        }
}

} // namespace
