#include "core/display.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace trilume {
namespace {

using Rgb = std::array<float, 3>;

Rgb shown(Rgb v, double exposure, ToneMap toneMap) {
    toDisplay(v, exposure, toneMap);
    return v;
}

class DisplayTest : public testing::TestWithParam<ToneMap> {};
INSTANTIATE_TEST_SUITE_P(ToneMaps, DisplayTest, testing::Values(ToneMap::None, ToneMap::Aces, ToneMap::Agx));

TEST_P(DisplayTest, BlackStaysBlackAndBrightBecomesWhite) {
    EXPECT_EQ(shown({0, 0, 0}, 0, GetParam()), (Rgb{0, 0, 0}));
    for (const float bright : {1e4f, 1e30f, std::numeric_limits<float>::infinity()})
        for (const float x : shown({bright, bright, bright}, 0, GetParam())) EXPECT_GT(x, 0.995f) << bright;
}

TEST_P(DisplayTest, NothingLeavesTheRange) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float r : {nan, -1.0f, 0.0f, 1e-30f, 0.2f, 1.0f, 1e9f, 3e38f})
        for (const float g : {nan, -1e30f, 0.0f, 0.01f, 5.0f, 1e20f})
            for (const double exposure : {-100.0, 0.0, 20.0, 1000.0})
                for (const float x : shown({r, g, 0.5f}, exposure, GetParam())) {
                    EXPECT_GE(x, 0) << r << ' ' << g;
                    EXPECT_LE(x, 1) << r << ' ' << g;
                }
}

TEST_P(DisplayTest, BrighterGreyIsNeverDarker) {
    float last = 0;
    for (double ev = -14; ev < 8; ev += 0.01) {
        const float grey = static_cast<float>(std::exp2(ev));
        const Rgb v = shown({grey, grey, grey}, 0, GetParam());
        EXPECT_GE(v[1], last - 1e-6f) << "at " << ev << " EV";
        EXPECT_NEAR(v[0], v[1], 2e-3) << "grey stays grey";
        EXPECT_NEAR(v[2], v[1], 2e-3);
        last = v[1];
    }
}

TEST_P(DisplayTest, ExposureIsAFactor) {
    const Rgb bright = shown({0.4f, 0.8f, 0.2f}, 0, GetParam());
    const Rgb scaled = shown({0.1f, 0.2f, 0.05f}, 2, GetParam());
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(bright[c], scaled[c], 1e-6);
}

TEST(Display, MidGreyLandsWhereTheSourcesPutIt) {
    const Rgb grey{0.18f, 0.18f, 0.18f};
    EXPECT_NEAR(shown(grey, 0, ToneMap::None)[1], 0.4613561, 1e-5); // IEC 61966-2-1
    // Hill's fit by hand: (0.18 * 0.2045786 - 0.000090537) / (0.18 * 0.61002222 + 0.238081) = 0.10559, sRGB-encoded.
    EXPECT_NEAR(shown(grey, 0, ToneMap::Aces)[1], 0.3585, 1e-3);
    // Sobotka's curve passes its pivot, 10 of 16.5 stops up, which is 0.18, at 0.5; 0.5^2.2 is sRGB-encoded 0.5029. The
    // polynomial is within 1% of the curve.
    EXPECT_NEAR(shown(grey, 0, ToneMap::Agx)[1], 0.5029, 0.01);
}

TEST(Display, SaturatedBrightColoursFadeTowardsWhiteInAgx) {
    const Rgb red = shown({60, 0.6f, 0.6f}, 0, ToneMap::Agx);
    EXPECT_GT(red[1], 0.5f);
    EXPECT_GT(red[0], red[1]);
    EXPECT_EQ(shown({60, 0, 0}, 0, ToneMap::None)[1], 0);
}

TEST(Display, SrgbEncodingEndsAndJoint) {
    EXPECT_EQ(srgbFromLinear(0), 0);
    EXPECT_NEAR(srgbFromLinear(1), 1, 1e-6);
    EXPECT_NEAR(srgbFromLinear(0.0031308f), srgbFromLinear(0.0031309f), 1e-5);
}

} // namespace
} // namespace trilume
