#include "core/file.h"
#include "errors.h"
#include "plugin/registry.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <thread>

namespace trilume {
namespace {
namespace fs = std::filesystem;
using test::messageOf;

/// Through the registry, as the command does: the plugin is found by its plugin.json and loaded on first use.
class ImageIo : public testing::Test {
protected:
    ImageIo() {
        std::string name = (fs::temp_directory_path() / "trilume-image-XXXXXX").string();
        folder = ::mkdtemp(name.data());
    }
    ~ImageIo() override { fs::remove_all(folder); }

    Texture roundTrip(const char* file, const ImageData& image, ColorSpace colorSpace = ColorSpace::Auto) {
        registry.writeImage(folder / file, image);
        return registry.readTexture(folder / file, colorSpace);
    }

    Registry registry;
    fs::path folder;
};

/// 2 x 2, so that a flipped row shows; values that 8 bits or RGBE could not hold.
ImageData linearImage() { return {2, 2, 3, {0, 1e-6f, 1.25f, 3e4f, 0.5f, 0.1f, -2, 7, 8, 9, 10, 11}}; }

TEST_F(ImageIo, ExrKeepsEveryBit) {
    const ImageData image = linearImage();
    const Texture texture = roundTrip("x.exr", image);
    ASSERT_EQ(texture.rgba32f.size(), 16u);
    EXPECT_FALSE(texture.srgb);
    for (size_t i = 0; i < 4; ++i)
        for (size_t c = 0; c < 3; ++c) EXPECT_EQ(texture.rgba32f[4 * i + c], image.pixels[3 * i + c]);
}

TEST_F(ImageIo, ExrDropsAlphaAndNamesRec709) {
    roundTrip("x.exr", {1, 1, 4, {1, 2, 3, 0.5f}});
    const std::string bytes = readTextFile(folder / "x.exr");
    EXPECT_NE(bytes.find("chromaticities"), std::string::npos);
    EXPECT_EQ(bytes.find(std::string("A\0", 2) + std::string("\2\0\0\0", 4)), std::string::npos) << "no channel A";
}

TEST_F(ImageIo, ExrBytesDependOnPixelsAlone) {
    registry.writeImage(folder / "a.exr", linearImage());
    std::this_thread::sleep_for(std::chrono::milliseconds(1100)); // File times have seconds.
    registry.writeImage(folder / "b.exr", linearImage());
    EXPECT_EQ(readTextFile(folder / "a.exr"), readTextFile(folder / "b.exr"));
}

/// All slices of it would be written over the memory of one.
TEST_F(ImageIo, VolumesAreNoTextures) {
    constexpr uint32_t kSide = 4, kSlices = 64;
    std::array<uint32_t, 32> header{};
    header[0] = 0x20534444; // "DDS "
    header[1] = 124;
    header[2] = 0x1 | 0x2 | 0x4 | 0x1000 | 0x800000; // caps, height, width, pixel format, depth
    header[3] = header[4] = kSide;
    header[6] = kSlices;
    header[19] = 32; // pixel format: RGBA of 8 bits
    header[20] = 0x41;
    header[22] = 32;
    header[23] = 0xff, header[24] = 0xff00, header[25] = 0xff0000, header[26] = 0xff000000;
    header[27] = 0x1008;
    header[28] = 0x200000; // a volume
    std::string bytes(reinterpret_cast<const char*>(header.data()), sizeof header);
    bytes += std::string(size_t{4} * kSide * kSide * kSlices, '\x7f');
    std::ofstream(folder / "volume.dds", std::ios::binary) << bytes;
    const std::string error = messageOf([&] { registry.readTexture(folder / "volume.dds", ColorSpace::Auto); });
    EXPECT_NE(error.find("not a flat image"), std::string::npos) << error;
    EXPECT_NE(error.find("64 slices"), std::string::npos) << error;
}

TEST_F(ImageIo, AovsOfOneAndTwoChannels) {
    EXPECT_EQ(roundTrip("depth.exr", {1, 2, 1, {4, 5}}).rgba32f, (std::vector<float>{4, 4, 4, 1, 5, 5, 5, 1}));
    const Texture motion = roundTrip("motion.exr", {1, 1, 2, {-3, 6}});
    EXPECT_EQ(motion.rgba32f[0], -3);
}

TEST_F(ImageIo, HdrHoldsRgbePrecision) {
    const ImageData image = linearImage();
    const Texture texture = roundTrip("x.hdr", image);
    for (size_t i = 0; i < 4; ++i) {
        // The largest component's exponent is shared: 8 bits of it.
        const float largest = std::max({image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2]});
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(texture.rgba32f[4 * i + c], std::max(0.0f, image.pixels[3 * i + c]), largest / 128);
    }
}

TEST_F(ImageIo, PngQuantisesAndClamps) {
    const Texture texture =
        roundTrip("x.png", {2, 2, 3, {0, 0.5f, 1, 2, -1, NAN, 10.4f / 255, 10.6f / 255, 1, 0, 0, 0}});
    EXPECT_TRUE(texture.srgb);
    EXPECT_EQ(texture.rgba8, (std::vector<uint8_t>{0, 128, 255, 255, 255, 0, 0, 255, 10, 11, 255, 255, 0, 0, 0, 255}));
}

TEST_F(ImageIo, JpgIsClose) {
    ImageData image{16, 16, 3, {}};
    for (int i = 0; i < 256; ++i) image.pixels.insert(image.pixels.end(), {i / 255.0f, 0.5f, 0.25f});
    const Texture texture = roundTrip("x.jpg", image);
    ASSERT_EQ(texture.rgba8.size(), 1024u);
    for (size_t i = 0; i < 256; ++i) EXPECT_NEAR(texture.rgba8[4 * i], static_cast<double>(i), 10) << i;
}

TEST_F(ImageIo, ColorSpaceOfEightBitFiles) {
    registry.writeImage(folder / "rgb.png", {1, 1, 3, {0.5f, 0.5f, 0.5f}});
    registry.writeImage(folder / "grey.png", {1, 1, 1, {0.5f}});
    const auto srgb = [&](const char* file, ColorSpace c) { return registry.readTexture(folder / file, c).srgb; };
    EXPECT_TRUE(srgb("rgb.png", ColorSpace::Auto));
    EXPECT_FALSE(srgb("rgb.png", ColorSpace::Linear));
    EXPECT_FALSE(srgb("grey.png", ColorSpace::Auto));
    EXPECT_TRUE(srgb("grey.png", ColorSpace::Srgb));
    EXPECT_EQ(registry.readTexture(folder / "grey.png", ColorSpace::Auto).rgba8,
              (std::vector<uint8_t>{128, 128, 128, 255}));
}

TEST_F(ImageIo, FloatFilesDecodeSrgbOnlyWhenTold) {
    registry.writeImage(folder / "x.exr", {1, 1, 3, {0.5f, 0.02f, 1}});
    const Texture texture = registry.readTexture(folder / "x.exr", ColorSpace::Srgb);
    EXPECT_NEAR(texture.rgba32f[0], 0.21404114f, 1e-6f);
    EXPECT_NEAR(texture.rgba32f[1], 0.02f / 12.92f, 1e-8f);
    EXPECT_FALSE(texture.srgb) << "what is float is linear already";
}

/// Binary PGM and PPM with 16 bits a sample, big end first; and 2 x 1 pixels of it.
TEST_F(ImageIo, SixteenBitsBecomeLinearFloat) {
    std::ofstream(folder / "x.pgm", std::ios::binary) << "P5\n2 1\n65535\n" << std::string("\x80\x00\xff\xff", 4);
    const Texture texture = registry.readTexture(folder / "x.pgm", ColorSpace::Auto);
    ASSERT_EQ(texture.rgba32f.size(), 8u);
    EXPECT_NEAR(texture.rgba32f[0], 0.5, 1e-4); // OpenImageIO divides this format by 65536 or 65535, by version.
    EXPECT_NEAR(texture.rgba32f[4], 1, 1e-4);
}

TEST_F(ImageIo, BadFilesAreNamed) {
    const auto message = [&](const fs::path& path) {
        return messageOf([&] { registry.readTexture(path, ColorSpace::Auto); });
    };
    EXPECT_NE(message(folder / "none.png").find("none.png"), std::string::npos);
    std::ofstream(folder / "text.png") << "this is no picture";
    EXPECT_NE(message(folder / "text.png").find("text.png"), std::string::npos);
    // Not a PNG: there OpenImageIO 2.4 loses a string, since libpng reports errors by longjmp.
    registry.writeImage(folder / "whole.exr", {64, 64, 3, std::vector<float>(64 * 64 * 3, 0.3f)});
    const std::string whole = readTextFile(folder / "whole.exr");
    std::ofstream(folder / "half.exr", std::ios::binary) << whole.substr(0, whole.size() / 2);
    EXPECT_NE(message(folder / "half.exr").find("half.exr"), std::string::npos);
    EXPECT_NE(message(folder).find("folder"), std::string::npos);
    EXPECT_NE(messageOf([&] { registry.writeImage(folder / "x.gif", linearImage()); }).find(".exr"), std::string::npos);
}

TEST_F(ImageIo, WritingWhereNothingCanBeIsAnError) {
    EXPECT_THROW(registry.writeImage(folder / "no/such/x.exr", linearImage()), Error);
    EXPECT_THROW(registry.writeImage("/proc/x.png", linearImage()), Error);
}

} // namespace
} // namespace trilume
