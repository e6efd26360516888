// Sampled images: formats, mip levels, address modes, the bindless table.
#include "gpu/gpu_fixture.h"

#include "core/error.h"

#include <glm/glm.hpp>

#include <cmath>

using namespace trilume;
using trilume::test::GpuTest;

namespace {

struct SamplePush {
    VkDeviceAddress queries, result;
    uint32_t count;
};
struct Query {
    uint32_t image;
    float u, v, level;
};
const std::string kSample = R"(
#extension GL_EXT_nonuniform_qualifier : require
layout(set = 0, binding = 0) uniform sampler2D textures[];
struct Query { uint image; float u; float v; float level; };
TL_DECLARE_REF(Query)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { QueryRef queries; vec4Ref result; uint count; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    const Query q = push.queries.v[i];
    push.result.v[i] = textureLod(textures[nonuniformEXT(q.image)], vec2(q.u, q.v), q.level);
}
)";

float linearFromSrgb(int code) {
    const double v = code / 255.0;
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

class ImageTest : public GpuTest {
protected:
    gpu::Image image(uint32_t width, uint32_t height, VkFormat format, const auto& texels, gpu::SamplerMode mode = {}) {
        return device().createImage(width, height, format, std::as_bytes(std::span(texels)), mode, "test image");
    }
    std::vector<glm::vec4> sample(const std::vector<Query>& queries) {
        const auto in = bufferOf(queries);
        const auto out = bufferFor<glm::vec4>(queries.size());
        const auto count = static_cast<uint32_t>(queries.size());
        runCompute(kSample, SamplePush{in.address(), out.address(), count}, count);
        return read<glm::vec4>(out, queries.size());
    }
    glm::vec4 sample(const gpu::Image& image, float u, float v, float level = 0) {
        return sample({{image.bindlessIndex(), u, v, level}}).front();
    }
    static void expectNear(glm::vec4 a, glm::vec4 b, float tolerance) {
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << "channel " << c;
    }
};

TEST_F(ImageTest, srgbIsDecodedAndFilteredAsLight) {
    // Half black, half white: the mean of the light is 1/2, whose code is 188, not 127. Alpha stays linear.
    std::vector<uint8_t> texels;
    for (int i = 0; i < 16; ++i) {
        const uint8_t code = i % 2 ? 255 : 0;
        texels.insert(texels.end(), {code, code, 100, static_cast<uint8_t>(code)});
    }
    const auto srgb = image(4, 4, VK_FORMAT_R8G8B8A8_SRGB, texels),
               plain = image(4, 4, VK_FORMAT_R8G8B8A8_UNORM, texels);
    // 188 decodes to 0.5029: within half a code of 1/2. Filtering precision adds 1/256 of the range at most.
    expectNear(sample(srgb, 0.5f, 0.5f, 2),
               {linearFromSrgb(188), linearFromSrgb(188), linearFromSrgb(100), 128 / 255.f}, 1e-3f);
    expectNear(sample(plain, 0.5f, 0.5f, 2), {128 / 255.f, 128 / 255.f, 100 / 255.f, 128 / 255.f}, 1e-3f);
    expectNear(sample(srgb, 0.375f, 0.375f), {1, 1, linearFromSrgb(100), 1}, 1e-3f);
}

TEST_F(ImageTest, everyLevelOfAFloatImageHasItsMean) {
    // Sizes that do not halve evenly; values beyond 1.
    constexpr uint32_t kWidth = 13, kHeight = 7;
    std::vector<glm::vec4> texels(kWidth * kHeight);
    glm::dvec4 sum(0);
    for (uint32_t i = 0; i < texels.size(); ++i) {
        texels[i] = {float(i), i % 3 ? 0.f : 1000.f, i % 5 * 0.25f, -float(i % 7)};
        sum += texels[i];
    }
    const auto mean = glm::vec4(sum / double(texels.size()));
    const auto whole = image(kWidth, kHeight, VK_FORMAT_R32G32B32A32_SFLOAT, texels);
    expectNear(sample(whole, 0.3f, 0.6f, 3), mean, 1e-3f); // 13x7, 6x3, 3x1, 1x1
    // Level 1 by texel centres.
    std::vector<Query> queries;
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 6; ++x)
            queries.push_back({whole.bindlessIndex(), (float(x) + 0.5f) / 6, (float(y) + 0.5f) / 3, 1});
    glm::vec4 total(0);
    for (const glm::vec4& texel : sample(queries)) total += texel / 18.f;
    expectNear(total, mean, 0.02f);
}

TEST_F(ImageTest, levelsBlend) {
    std::vector<glm::vec4> texels(16, glm::vec4(0));
    texels[0] = glm::vec4(16);
    const auto whole = image(4, 4, VK_FORMAT_R32G32B32A32_SFLOAT, texels);
    expectNear(sample(whole, 0.25f, 0.25f, 1), glm::vec4(4), 1e-3f);
    expectNear(sample(whole, 0.25f, 0.25f, 1.5f), glm::vec4(2.5f), 0.02f);
}

TEST_F(ImageTest, addressModes) {
    std::vector<glm::vec4> texels = {glm::vec4(1), glm::vec4(2), glm::vec4(3), glm::vec4(4)};
    const auto row = [&](VkSamplerAddressMode mode) {
        return image(4, 1, VK_FORMAT_R32G32B32A32_SFLOAT, texels, {mode, VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE});
    };
    const auto repeat = row(VK_SAMPLER_ADDRESS_MODE_REPEAT), clamp = row(VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE),
               mirror = row(VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT),
               border = row(VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER);
    const float u = 1.375f; // centre of the second texel beyond the right edge
    const auto result = sample({{repeat.bindlessIndex(), u, 0.5f, 0},
                                {clamp.bindlessIndex(), u, 0.5f, 0},
                                {mirror.bindlessIndex(), u, 0.5f, 0},
                                {border.bindlessIndex(), u, 0.5f, 0}});
    expectNear(result[0], glm::vec4(2), 1e-3f);
    expectNear(result[1], glm::vec4(4), 1e-3f);
    expectNear(result[2], glm::vec4(3), 1e-3f);
    expectNear(result[3], glm::vec4(0), 1e-3f);
}

TEST_F(ImageTest, indicesAreGivenAgainOnlyWhenFree) {
    const std::vector<uint8_t> texel = {255, 0, 0, 255};
    const auto kept = image(1, 1, VK_FORMAT_R8G8B8A8_UNORM, texel);
    uint32_t highest = 0;
    for (int i = 0; i < 50; ++i) {
        const auto passing = image(1, 1, VK_FORMAT_R8G8B8A8_UNORM, texel);
        EXPECT_NE(passing.bindlessIndex(), kept.bindlessIndex());
        highest = std::max(highest, passing.bindlessIndex());
        expectNear(sample(passing, 0.5f, 0.5f), {1, 0, 0, 1}, 1e-6f);
    }
    EXPECT_LT(highest, 20u);
    expectNear(sample(kept, 0.5f, 0.5f), {1, 0, 0, 1}, 1e-6f);
}

TEST_F(ImageTest, stagingDoesNotGrowWithTheNumberOfImages) {
    constexpr uint32_t kSide = 2048;
    constexpr size_t kMiB = 1 << 20, kImages = 6, kBytes = size_t{4} * kSide * kSide; // 21.3 MiB each with its levels
    gpu::Device small({.device = "auto", .validation = true, .memoryLimit = 220 * kMiB});
    const std::vector<std::byte> pixels(kBytes);
    std::vector<gpu::Image> images;
    for (size_t i = 0; i < kImages; ++i)
        images.push_back(small.createImage(kSide, kSide, VK_FORMAT_R8G8B8A8_UNORM, pixels, {}, "image"));
    EXPECT_LT(small.memoryInUse(), 220 * kMiB);
}

TEST_F(ImageTest, anImageUnderConstructionMayBeDropped) {
    const std::vector<uint8_t> texels(64 * 64 * 4, 9);
    image(64, 64, VK_FORMAT_R8G8B8A8_UNORM, texels); // its upload is still queued when it goes
    device().submit([](gpu::Commands&) {});
}

TEST_F(ImageTest, wrongSizesAreErrors) {
    const std::vector<uint8_t> texels(16);
    EXPECT_THROW(image(0, 4, VK_FORMAT_R8G8B8A8_UNORM, texels), Error);
    EXPECT_THROW(image(4, 4, VK_FORMAT_R8G8B8A8_UNORM, texels), Error);
    EXPECT_THROW(image(2, 2, VK_FORMAT_R16G16_UNORM, texels), Error);
    EXPECT_THROW(image(1 << 20, 1, VK_FORMAT_R8G8B8A8_UNORM, texels), Error);
}

} // namespace
