// The binding-free shader library: samples, maps from the square, octahedral packing, MIS weights, small maths.

#include "gpu/gpu_fixture.h"
#include "statistics.h"

#include <glm/glm.hpp>

#include <cmath>
#include <cstring>
#include <limits>

using namespace trilume;
using trilume::test::chiSquaredTest;
using trilume::test::normalTail;
using trilume::test::sidak;

namespace {

constexpr double kOverallSignificance = 1e-3;

class LibTest : public test::GpuTest {
protected:
    struct Push {
        VkDeviceAddress in, out;
        uint32_t count;
    };

    /// Runs `body`, statements that set `vec4 r` from thread number `i` and `vec4 a` = input[i] (0 past its end).
    std::vector<glm::vec4> map(const std::string& body, uint32_t count, std::vector<glm::vec4> input = {}) {
        input.resize(count);
        const gpu::Buffer in = bufferOf(input), out = bufferFor<glm::vec4>(count);
        runCompute(R"(
#include "lib/color.glsl"
#include "lib/math.glsl"
#include "lib/mis.glsl"
#include "lib/octahedral.glsl"
#include "lib/reservoir.glsl"
#include "lib/rng.glsl"
#include "lib/sampling.glsl"
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { vec4Ref source; vec4Ref result; uint count; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    const vec4 a = push.source.v[i];
    vec4 r = vec4(0.0);
)" + body + "\n    push.result.v[i] = r;\n}",
                   Push{in.address(), out.address(), count}, count);
        return read<glm::vec4>(out, count);
    }

    /// Chi-squared probability that points (x, y) are uniform on the unit square.
    static double uniformity(const std::vector<glm::vec4>& points, int cells = 32) {
        std::vector<double> observed(size_t(cells) * cells);
        for (const glm::vec4& p : points) {
            const auto cell = [&](float v) { return std::clamp(int(v * float(cells)), 0, cells - 1); };
            ++observed[size_t(cell(p.y)) * cells + cell(p.x)];
        }
        return chiSquaredTest(observed, std::vector<double>(observed.size(), double(points.size()) / observed.size()));
    }

    /// Probability of a correlation between x and y as strong as this among independent ones.
    static double correlation(const std::vector<glm::vec4>& points) {
        double xy = 0; // uniform on [0,1): mean 1/2, variance 1/12
        for (const glm::vec4& p : points) xy += 12 * (double(p.x) - 0.5) * (double(p.y) - 0.5);
        return normalTail(xy / std::sqrt(double(points.size())));
    }
};

const char* const kKinds[] = {"kSamplerIndependent", "kSamplerSobol"};

TEST_F(LibTest, samplesStayBelowOne) {
    for (const char* kind : kKinds) {
        const auto points = map(std::string("Sampler s = samplerInit(uvec2(i, i >> 3), i * 7u, 3u, ") + kind +
                                    "); r = vec4(sample3D(s), sample1D(s));",
                                1 << 18);
        for (const glm::vec4& p : points)
            for (int c = 0; c < 4; ++c) ASSERT_TRUE(p[c] >= 0 && p[c] < 1) << kind << ' ' << p[c];
    }
    const auto ends = map("r = vec4(unitFloat(0u), unitFloat(0xffffffffu), unitFloat(0x80000000u), 0.0);", 1);
    EXPECT_EQ(ends[0], glm::vec4(0, 1 - std::ldexp(1.0f, -24), 0.5f, 0));
}

/// Each aligned run of 2^m points of a Sobol pair has one point in every elementary interval of area 2^-m.
TEST_F(LibTest, sobolPairsAreNets) {
    constexpr int kPower = 8, kRun = 1 << kPower;
    const auto points = map("Sampler s = samplerInit(uvec2(i / 4096u, 5u), i % 1024u, 11u, kSamplerSobol);"
                            "s.dimension = 3u * ((i / 1024u) % 4u); r.xy = sample2D(s); r.z = sample1D(s);",
                            1 << 16);
    for (size_t run = 0; run < points.size() / kRun; ++run) {
        for (int split = 0; split <= kPower; ++split) {
            std::vector<int> seen(kRun), seenAlone(kRun);
            for (size_t i = run * kRun; i < (run + 1) * kRun; ++i) {
                const auto column = size_t(std::ldexp(points[i].x, split));
                const auto row = size_t(std::ldexp(points[i].y, kPower - split));
                ++seen[(row << split) + column];
                ++seenAlone[size_t(points[i].z * kRun)];
            }
            for (int i = 0; i < kRun; ++i) {
                ASSERT_EQ(seen[i], 1) << "run " << run << ", " << split << " bits of x";
                ASSERT_EQ(seenAlone[i], 1) << "run " << run;
            }
        }
    }
}

/// Uniform and uncorrelated across samples, pixels, dimensions and seeds.
TEST_F(LibTest, samplesAreUniformAndIndependent) {
    // Pairs (x, y) that must be independent uniforms over threads.
    const char* const kPairs[] = {
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 0u, 0u, kind); r.xy = sample2D(s);",
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 5u, 1u, kind); r.x = sample1D(s); r.y = sample1D(s);",
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 6u, 2u, kind); sample2D(s); r.x = sample2D(s).y; r.y = "
        "sample2D(s).x;",
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 7u, 3u, kind); r.x = sample1D(s);"
        "s = samplerInit(uvec2((i & 511u) + 512u, i >> 9), 7u, 3u, kind); r.y = sample1D(s);",
        "Sampler s = samplerInit(uvec2(2u * (i & 511u), i >> 9), 7u, 3u, kind); r.x = sample1D(s);"
        "s = samplerInit(uvec2(2u * (i & 511u) + 1u, i >> 9), 7u, 3u, kind); r.y = sample1D(s);",
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 9u, 4u, kind); r.x = sample1D(s);"
        "s = samplerInit(uvec2(i & 511u, i >> 9), 9u, 5u, kind); r.y = sample1D(s);",
        "Sampler s = samplerInit(uvec2(i & 511u, i >> 9), 9u, 4u, kind); r.x = sample2D(s).y;"
        "s = samplerInit(uvec2(i & 511u, i >> 9), 10u, 4u, kind); s.dimension = 1u; r.y = sample2D(s).y;",
        "Sampler s = samplerInit(uvec2(i, 0u), i, 7u, kind); r.xy = sample2D(s);",
        "Sampler s = samplerInit(uvec2(3u, 4u), 17u, i, kind); r.xy = sample2D(s);",
        "Sampler s = samplerInit(uvec2(3u, 4u), 17u, 8u, kind); s.dimension = i; r.xy = sample2D(s);",
    };
    const double significance = sidak(kOverallSignificance, 2 * 2 * std::size(kPairs));
    for (const char* kind : kKinds)
        for (const char* pair : kPairs) {
            const auto points = map(std::string("const uint kind = ") + kind + "; " + pair, 1 << 17);
            EXPECT_GT(uniformity(points), significance) << kind << ": " << pair;
            EXPECT_GT(correlation(points), significance) << kind << ": " << pair;
        }
}

/// Each map's inverse, as cumulative probabilities, makes the square uniform again.
TEST_F(LibTest, mapsFollowTheirDensities) {
    const std::pair<const char*, const char*> kMaps[] = {
        {"disk", "const vec2 d = sampleDisk(u); r = vec4(dot(d, d), atan(d.y, d.x) / kTwoPi + 0.5, 0.0, 0.0);"},
        {"cosine",
         "const vec3 d = sampleCosineHemisphere(u); r = vec4(d.z * d.z, atan(d.y, d.x) / kTwoPi + 0.5, 0.0, 0.0);"},
        {"sphere",
         "const vec3 d = sampleSphere(u); r = vec4(0.5 - 0.5 * d.z, atan(d.y, d.x) / kTwoPi + 0.5, 0.0, 0.0);"},
        {"hemisphere", "const vec3 d = sampleHemisphere(u); r = vec4(d.z, atan(d.y, d.x) / kTwoPi + 0.5, 0.0, 0.0);"},
        {"cone",
         "const vec3 d = sampleCone(u, 0.3); r = vec4((1.0 - d.z) / 0.3, atan(d.y, d.x) / kTwoPi + 0.5, 0.0, 0.0);"},
        {"triangle", "const vec2 b = sampleTriangle(u); r = vec4(1.0 - sqr(1.0 - b.x), b.y / (1.0 - b.x), 0.0, 0.0);"},
    };
    const double significance = sidak(kOverallSignificance, std::size(kMaps));
    for (const auto& [name, code] : kMaps)
        EXPECT_GT(uniformity(map(std::string("const vec2 u = unitFloat(pcg3d(uvec3(i, 1u, 2u)).xy);") + code, 1 << 18)),
                  significance)
            << name;
}

TEST_F(LibTest, directionsAreUnit) {
    const auto lengths = map("const vec2 u = vec2(float(i % 33u), float(i / 33u)) / 32.0 * kOneMinusEpsilon;"
                             "r = vec4(length(sampleCosineHemisphere(u)), length(sampleSphere(u)),"
                             "         length(sampleHemisphere(u)), length(sampleCone(u, 1e-9)));",
                             33 * 33);
    for (const glm::vec4& l : lengths)
        for (int c = 0; c < 4; ++c) ASSERT_NEAR(l[c], 1, 1e-6);
}

TEST_F(LibTest, octahedralPackingKeepsDirections) {
    const auto errors = map("const vec3 n = sampleSphere(unitFloat(pcg3d(uvec3(i, 3u, 4u)).xy));"
                            "r = vec4(length(octahedralUnpack(octahedralPack(n)) - n),"
                            "         length(octahedralDecode(octahedralEncode(n)) - n), 0.0, 0.0);",
                            1 << 16);
    for (const glm::vec4& e : errors) {
        ASSERT_LT(e.x, 7e-5);
        ASSERT_LT(e.y, 5e-7);
    }
    const auto axes = map("vec3 n = vec3(0.0); n[i % 3u] = i < 3u ? 1.0 : -1.0;"
                          "r = vec4(octahedralUnpack(octahedralPack(n)) - n, 0.0);",
                          6);
    for (const glm::vec4& e : axes) EXPECT_EQ(e, glm::vec4(0));
}

TEST_F(LibTest, heuristicsStayFinite) {
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<glm::vec4> densities = {
        {0, 0, 0, 0},   {1, 0, 0, 0},     {0, 1, 0, 0},         {1, 3, 0, 0},          {inf, 1, 0, 0},
        {1, inf, 0, 0}, {inf, inf, 0, 0}, {1e30f, 1e30f, 0, 0}, {1e-38f, 3e38f, 0, 0}, {3e38f, 3e38f, 0, 0}};
    const auto weights =
        map("r = vec4(balanceHeuristic(a.x, a.y), powerHeuristic(a.x, a.y), balanceHeuristic(a.y, a.x),"
            "         powerHeuristic(a.y, a.x));",
            uint32_t(densities.size()), densities);
    for (size_t i = 0; i < weights.size(); ++i) {
        const double sum = densities[i].x == 0 && densities[i].y == 0 ? 0 : 1;
        EXPECT_NEAR(weights[i].x + weights[i].z, sum, 1e-6) << i;
        EXPECT_NEAR(weights[i].y + weights[i].w, sum, 1e-6) << i;
    }
    EXPECT_FLOAT_EQ(weights[3].x, 0.25f);
    EXPECT_FLOAT_EQ(weights[3].y, 0.1f);
    EXPECT_EQ(weights[4].y, 1);
    EXPECT_EQ(weights[5].y, 0);
}

TEST_F(LibTest, basisIsOrthonormal) {
    const auto errors = map("vec3 n = sampleSphere(unitFloat(pcg3d(uvec3(i, 3u, 4u)).xy));"
                            "if (i < 4u) n = vec3(0.0, 0.0, i < 2u ? 1.0 : -1.0);"
                            "if (i == 1u || i == 3u) n = normalize(vec3(1e-5, -1e-6, n.z));"
                            "const mat3 m = basisAround(n); const mat3 e = transpose(m) * m - mat3(1.0);"
                            "r = vec4(maxComponent(abs(e[0])), maxComponent(abs(e[1])), maxComponent(abs(m[2] - n)),"
                            "         determinant(m));",
                            1 << 14);
    for (const glm::vec4& e : errors) {
        ASSERT_LT(std::max({e.x, e.y}), 1e-6);
        ASSERT_EQ(e.z, 0);
        ASSERT_NEAR(e.w, 1, 1e-6);
    }
}

TEST_F(LibTest, finiteTestsSeeEveryKind) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    const auto r = map("r = vec4(isFinite(a.x), isFinite(a.xyz), isFinite(safeDivide(a.y, a.z)),"
                       "         isFinite(safeNormalize(a.xyz, vec3(1.0, 0.0, 0.0))));",
                       5, {{1, 2, 3, 0}, {inf, 0, 0, 0}, {nan, 1, 0, 0}, {1, -inf, 0, 0}, {1e-40f, 1e-40f, 1e-40f, 0}});
    EXPECT_EQ(r[0], glm::vec4(1));
    EXPECT_EQ(r[1], glm::vec4(0, 0, 1, 1));
    EXPECT_EQ(r[2], glm::vec4(0, 0, 1, 1));
    EXPECT_EQ(r[3], glm::vec4(1, 0, 1, 1));
    EXPECT_EQ(r[4], glm::vec4(1));
    const auto srgb = map("r = vec4(linearFromSrgb(srgbFromLinear(a.xyz)), luminance(vec3(1.0)));", 2,
                          {{0, 0.002f, 0.5f, 0}, {1, 0.0031308f, 0.18f, 0}});
    EXPECT_NEAR(srgb[0].z, 0.5, 1e-5);
    EXPECT_NEAR(srgb[0].y, 0.002, 1e-6);
    EXPECT_NEAR(srgb[1].z, 0.18, 1e-5);
    EXPECT_NEAR(srgb[1].w, 1, 1e-6);
}

// Of all techniques that could have drawn a sample; targets over 60 decades, some of them 0, confidences of 1 to 100.
TEST_F(LibTest, pairwiseWeightsSumToOne) {
    const auto sums = map(R"(
    Sampler s = samplerInit(uvec2(i, 0u), 0u, 5u, kSamplerIndependent);
    float p[5], c[5], others = 0.0;
    for (uint k = 0u; k < 5u; ++k) {
        p[k] = k > 0u && sample1D(s) < 0.2 ? 0.0 : pow(10.0, 60.0 * sample1D(s) - 30.0);
        c[k] = exp2(6.6 * sample1D(s));
        if (k > 0u) others += c[k];
    }
    float canonical = c[0] / (c[0] + others);
    r.y = 1.0;
    for (uint k = 1u; k < 5u; ++k) {
        const float m = pairwiseNeighbor(c[0], others, c[k], p[0], p[k]);
        canonical += pairwiseCanonical(c[0], others, c[k], p[0], p[k]);
        r.x += m;
        r.y = min(r.y, p[k] > 0.0 ? m : 1.0 - m);
    }
    r.x += canonical;
    r.z = canonical - c[0] / (c[0] + others);)",
                          1 << 14);
    for (const glm::vec4& s : sums) {
        ASSERT_NEAR(s.x, 1, 1e-5);
        ASSERT_GE(s.y, 0) << "a negative weight, or one for what the technique cannot draw";
        ASSERT_GE(s.z, 0) << "the canonical technique keeps its share";
    }
}

} // namespace
