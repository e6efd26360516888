#include "image_io.h"

#include "core/error.h"
#include "core/text.h"

#include <OpenImageIO/imageio.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace trilume {
namespace {

constexpr int kLargestSide = 32768;

/// The failed call's message on one line, without the path, which the error names anyway.
std::string reasonOf(const std::string& message) { return message.empty() ? "no reason was given" : oneLine(message); }

// ---- writing ----

/// The first `kept` of each pixel's channels; a single one is repeated where more are wanted.
std::vector<float> selectChannels(const ImageData& image, uint32_t kept) {
    std::vector<float> values(size_t{image.width} * image.height * kept);
    for (size_t pixel = 0; pixel < values.size() / kept; ++pixel)
        for (uint32_t c = 0; c < kept; ++c)
            values[pixel * kept + c] = image.pixels[pixel * image.channels + std::min(c, image.channels - 1)];
    return values;
}

OIIO::ImageSpec specFor(const std::string& extension, const ImageData& image) {
    const bool display = extension == ".png" || extension == ".jpg" || extension == ".jpeg";
    const int channels =
        extension == ".exr" || image.channels == 1 ? static_cast<int>(std::min(image.channels, 3u)) : 3;
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels,
                         display ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT);
    if (channels == 2) spec.channelnames = {"X", "Y"};
    if (extension == ".exr") {
        // ITU-R BT.709: red, green, blue, white (D65), x and y each.
        constexpr std::array<float, 8> kRec709{0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
        spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), kRec709.data());
        spec.attribute("compression", "zip");
        spec.attribute("DateTime", ""); // Else the time of day: the same pixels shall give the same file.
    }
    if (extension == ".jpg" || extension == ".jpeg") spec.attribute("Compression", "jpeg:95");
    spec.attribute("oiio:ColorSpace", display ? "sRGB" : "Linear");
    return spec;
}

// ---- reading ----

std::unique_ptr<OIIO::ImageInput> openTexture(const std::filesystem::path& path) {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    auto input = OIIO::ImageInput::open(path.string(), &config);
    if (!input) throw inputError("cannot read texture", path.string(), reasonOf(OIIO::geterror()));
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.width > kLargestSide || spec.height > kLargestSide)
        throw inputError(
            "texture size out of range", path.string(),
            fmt::format("it has {} x {} pixels; {} a side are the most", spec.width, spec.height, kLargestSide));
    if (spec.depth > 1 || spec.deep || spec.nchannels < 1)
        throw inputError("not a flat image", path.string(),
                         fmt::format("it has {} slices and {} channels{}; write one slice with 1 to 4 channels",
                                     spec.depth, spec.nchannels, spec.deep ? " of many samples" : ""));
    return input;
}

template<class Value>
std::vector<Value> readPixels(OIIO::ImageInput& input, OIIO::TypeDesc type, int channels,
                              const std::filesystem::path& path) {
    const OIIO::ImageSpec& spec = input.spec();
    std::vector<Value> values(static_cast<size_t>(spec.width) * spec.height * channels);
    if (!input.read_image(0, 0, 0, channels, type, values.data()))
        throw inputError("cannot read texture", path.string(), reasonOf(input.geterror()));
    return values;
}

/// Grey spreads over RGB; two channels are grey and alpha; a missing alpha is `opaque`.
template<class Value>
std::vector<Value> toRgba(const std::vector<Value>& values, int channels, Value opaque) {
    const bool grey = channels < 3;
    const bool hasAlpha = channels == 2 || channels == 4;
    std::vector<Value> rgba(values.size() / channels * 4);
    for (size_t i = 0; i < rgba.size() / 4; ++i) {
        const Value* from = &values[i * channels];
        for (int c = 0; c < 3; ++c) rgba[4 * i + c] = from[grey ? 0 : c];
        rgba[4 * i + 3] = hasAlpha ? from[channels - 1] : opaque;
    }
    return rgba;
}

/// IEC 61966-2-1.
float linearFromSrgb(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

/// `wrapmodes`, OpenImageIO's metadata for both directions: "black,periodic". Without it black, by which UsdUVTexture
/// and Hydra understand that the file has no opinion.
std::array<Wrap, 2> wrapsOf(const OIIO::ImageSpec& spec) {
    const std::string both = spec.get_string_attribute("wrapmodes", "black");
    const size_t comma = both.find(',');
    std::array<Wrap, 2> wraps{};
    for (size_t i = 0; i < 2; ++i) {
        const std::string one = comma == both.npos ? both : i == 0 ? both.substr(0, comma) : both.substr(comma + 1);
        wraps[i] = one == "periodic" ? Wrap::Repeat
                   : one == "clamp"  ? Wrap::Clamp
                   : one == "mirror" ? Wrap::Mirror
                                     : Wrap::Black;
    }
    return wraps;
}

} // namespace

void writeImageFile(const std::filesystem::path& path, const ImageData& image) {
    const OIIO::ImageSpec spec = specFor(lowerExtension(path.string()), image);
    std::vector<float> values = selectChannels(image, static_cast<uint32_t>(spec.nchannels));
    // RGBE has no sign, and a NaN would become an arbitrary byte.
    if (lowerExtension(path.string()) != ".exr")
        for (float& x : values) x = x > 0 ? x : 0;

    const auto output = OIIO::ImageOutput::create(path.string());
    if (!output) throw runError("cannot write image", path.string(), reasonOf(OIIO::geterror()));
    if (!output->open(path.string(), spec) || !output->write_image(OIIO::TypeDesc::FLOAT, values.data()) ||
        !output->close())
        throw runError("cannot write image", path.string(), reasonOf(output->geterror()));
}

Texture readTextureFile(const std::filesystem::path& path, ColorSpace colorSpace) {
    const auto input = openTexture(path);
    const int channels = std::min(input->spec().nchannels, 4);
    Texture texture{.name = path.string(),
                    .width = static_cast<uint32_t>(input->spec().width),
                    .height = static_cast<uint32_t>(input->spec().height)};
    const std::array<Wrap, 2> wraps = wrapsOf(input->spec());
    texture.wrapS = wraps[0];
    texture.wrapT = wraps[1];
    const bool bytes = input->spec().format == OIIO::TypeDesc::UINT8;
    const bool srgb = colorSpace == ColorSpace::Srgb || (colorSpace == ColorSpace::Auto && bytes && channels >= 3);
    if (bytes) {
        texture.rgba8 =
            toRgba<uint8_t>(readPixels<uint8_t>(*input, OIIO::TypeDesc::UINT8, channels, path), channels, 255);
        texture.srgb = srgb;
        return texture;
    }
    texture.rgba32f = toRgba<float>(readPixels<float>(*input, OIIO::TypeDesc::FLOAT, channels, path), channels, 1);
    if (srgb)
        for (size_t i = 0; i < texture.rgba32f.size(); ++i)
            if (i % 4 != 3) texture.rgba32f[i] = linearFromSrgb(texture.rgba32f[i]);
    return texture;
}

} // namespace trilume
