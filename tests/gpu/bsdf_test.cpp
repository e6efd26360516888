// Exact properties of the BSDF library; its densities and energies are in statistical/bsdf_sampling_test.cpp.

#include "gpu/bsdf_fixture.h"

#include <cmath>
#include <random>

using namespace trilume;
using namespace trilume::test;

namespace {

class BsdfTest : public BsdfFixture {
protected:
    static constexpr uint32_t kFlagValid = 1, kFlagDelta = 2, kFlagTransmission = 4;

    struct Sample {
        glm::vec3 wi, weight;
        float pdf, roughness;
        uint32_t flags;
        float deltaProbability; ///< of the closure
        bool hasSmooth;
        glm::vec3 albedo;
    };
    /// One sample for each case from u = (0.3, 0.6, uz).
    std::vector<Sample> sample(const std::vector<BsdfCase>& cases, float uz) {
        const Output out = run(R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i];
    const Bsdf b = bsdfOf(c);
    const BsdfSample s = bsdfSample(b, c.wo, vec3(0.3, 0.6, )" +
                                   std::to_string(uz) + R"());
    for (int k = 0; k < 3; ++k) {
        push.result.v[16u * i + k] = s.wi[k];
        push.result.v[16u * i + 3u + k] = s.weight[k];
        push.result.v[16u * i + 10u + k] = bsdfAlbedo(b)[k];
    }
    push.result.v[16u * i + 6u] = s.pdfSolidAngle;
    push.result.v[16u * i + 7u] = s.roughness;
    push.result.v[16u * i + 8u] = bsdfDeltaProbability(b);
    push.result.v[16u * i + 9u] = float(bsdfHasSmooth(b));
    push.counts.v[i] = s.flags;
})",
                               cases, 1, 16 * cases.size(), cases.size());
        std::vector<Sample> samples;
        for (size_t i = 0; i < cases.size(); ++i) {
            const float* r = &out.result[16 * i];
            samples.push_back({{r[0], r[1], r[2]},
                               {r[3], r[4], r[5]},
                               r[6],
                               r[7],
                               out.counts[i],
                               r[8],
                               r[9] != 0,
                               {r[10], r[11], r[12]}});
        }
        return samples;
    }

    /// Materials of every kind, seen from random directions on both sides.
    static std::vector<BsdfCase> randomCases(size_t count, const std::vector<float>& roughnesses,
                                             const std::vector<float>& iors) {
        std::mt19937 random(7);
        const auto uniform = [&] { return std::uniform_real_distribution<float>(0, 1)(random); };
        const auto share = [&] { return float(int(uniform() * 3)) / 2; };
        std::vector<BsdfCase> cases;
        for (size_t i = 0; i < count; ++i) {
            const float sign = uniform() < 0.5f ? -1.0f : 1.0f;
            cases.push_back({.baseColor = {uniform(), share(), share()},
                             .metallic = share(),
                             .specularColor = {uniform(), share(), 1},
                             .roughness = roughnesses[random() % roughnesses.size()],
                             .transmissionColor = {uniform(), share(), 1},
                             .transmission = share(),
                             .ior = iors[random() % iors.size()],
                             .specular = share(),
                             .clearcoat = share(),
                             .clearcoatRoughness = roughnesses[random() % roughnesses.size()],
                             .clearcoatIor = iors[random() % iors.size()],
                             .specularWorkflow = uniform() < 0.3f,
                             .front = sign > 0,
                             .importance = 0,
                             .wo = sign * directionAt(uniform(), 6 * uniform())});
        }
        return cases;
    }
};

TEST_F(BsdfTest, withoutSpecularIsLambert) {
    // The common scene has no specular material; the reduced library must agree with the full one.
    const std::string body = R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i];
    float pdf;
    const vec3 f = bsdfEval(bsdfOf(c), c.wo, normalize(vec3(0.5, 0.1, c.wo.z)), pdf);
    push.result.v[4u * i] = f.x;
    push.result.v[4u * i + 1u] = pdf;
    push.result.v[4u * i + 2u] = bsdfEval(bsdfOf(c), c.wo, normalize(vec3(0.5, 0.1, -c.wo.z)), pdf).x;
})";
    std::vector<BsdfCase> cases;
    for (const float cosine : {1.0f, 0.5f, -0.2f})
        cases.push_back({.baseColor = glm::vec3(0.7f), .ior = 1, .wo = directionAt(cosine)});
    const Output full = run(body, cases, 1, 4 * cases.size());
    const Output reduced = run(body, cases, 1, 4 * cases.size(), 0, {{"TL_BSDF_SPECULAR", "0"}});
    for (size_t i = 0; i < cases.size(); ++i) {
        const float z = std::abs(cases[i].wo.z), cosine = z / std::sqrt(z * z + 0.26f);
        EXPECT_NEAR(full.result[4 * i], 0.7 / M_PI * cosine, 1e-6);
        EXPECT_NEAR(full.result[4 * i + 1], 1 / M_PI * cosine, 1e-6);
        EXPECT_EQ(full.result[4 * i + 2], 0);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(full.result[4 * i + k], reduced.result[4 * i + k], 1e-6);
    }
}

TEST_F(BsdfTest, roughnessZeroIsAMirror) {
    for (const float roughness : {0.0f, 1e-5f, 0.01f}) {
        const std::vector<BsdfCase> cases = {
            {.baseColor = {0.9f, 0.5f, 0.1f}, .metallic = 1, .roughness = roughness, .wo = directionAt(1)},
            {.baseColor = {1, 1, 1}, .metallic = 1, .roughness = roughness, .wo = -directionAt(0.3f)}};
        const std::vector<Sample> s = sample(cases, 0.4f);
        for (size_t i = 0; i < cases.size(); ++i) {
            const glm::vec3 wo = cases[i].wo;
            EXPECT_EQ(s[i].wi, glm::vec3(-wo.x, -wo.y, wo.z));
            EXPECT_EQ(s[i].deltaProbability, 1);
            EXPECT_EQ(s[i].roughness, 0);
            EXPECT_FALSE(s[i].hasSmooth);
            EXPECT_EQ(s[i].flags & (kFlagValid | kFlagDelta | kFlagTransmission), kFlagValid | kFlagDelta);
        }
        EXPECT_LT(glm::length(s[0].weight - glm::vec3(0.9f, 0.5f, 0.1f)), 1e-6);
        EXPECT_LT(glm::length(s[1].weight - glm::vec3(1)), 1e-6);
    }
}

/// Snell's law, Fresnel's choice, the tint once, and radiance's factor 1 / eta^2, from both sides.
TEST_F(BsdfTest, smoothDielectricRefracts) {
    for (const uint32_t importance : {0u, 1u})
        for (const uint32_t front : {1u, 0u})
            for (const float ior : {1.5f, 0.8f, 1.0f}) {
                const BsdfCase c{.roughness = 0,
                                 .transmissionColor = {0.9f, 0.6f, 0.3f},
                                 .transmission = 1,
                                 .ior = ior,
                                 .front = front,
                                 .importance = importance,
                                 .wo = directionAt(0.9f) * (front ? 1.0f : -1.0f)};
                const Sample s = sample({c}, 0.1f)[0];
                const float eta = front ? ior : 1 / ior;
                ASSERT_EQ(s.flags & 7u, kFlagValid | kFlagDelta | kFlagTransmission);
                EXPECT_FALSE(s.hasSmooth);
                EXPECT_LT(glm::length(glm::vec2(s.wi) * eta + glm::vec2(c.wo)), 1e-6);
                EXPECT_NEAR(glm::length(s.wi), 1, 1e-6);
                EXPECT_LT(s.wi.z * c.wo.z, 0);
                const float cosI = std::abs(c.wo.z), cosT = std::abs(s.wi.z);
                const float rp = (eta * cosI - cosT) / (eta * cosI + cosT),
                            rs = (cosI - eta * cosT) / (cosI + eta * cosT);
                const glm::vec3 transmitted =
                    (1 - 0.5f * (rp * rp + rs * rs)) * c.transmissionColor / (importance ? 1.0f : eta * eta);
                EXPECT_LT(glm::length(s.weight * s.pdf - transmitted), 2e-6) << c.describe();
            }
    // Beyond the critical angle all is reflected.
    const Sample total = sample({{.roughness = 0, .transmission = 1, .front = 0, .wo = -directionAt(0.5f)}}, 0.1f)[0];
    EXPECT_EQ(total.flags & 7u, kFlagValid | kFlagDelta);
    EXPECT_LT(glm::length(total.weight - glm::vec3(1)), 1e-6);
}

/// A delta lobe is taken exactly where u.z lies below bsdfDeltaProbability.
TEST_F(BsdfTest, deltaLobesComeFirst) {
    const auto cases = randomCases(1 << 10, {0, 0.005f, 0.2f, 0.7f}, {1, 1.5f});
    for (const float uz : {0.02f, 0.2f, 0.5f, 0.8f, 0.98f}) {
        const std::vector<Sample> samples = sample(cases, uz);
        for (size_t i = 0; i < cases.size(); ++i) {
            if (!(samples[i].flags & kFlagValid) || std::abs(samples[i].deltaProbability - uz) < 1e-5f) continue;
            EXPECT_EQ((samples[i].flags & kFlagDelta) != 0, uz < samples[i].deltaProbability) << cases[i].describe();
        }
    }
}

/// f_radiance(wo, wi) = f_importance(wi, wo): reciprocity for reflection, and with the squared indices for refraction.
TEST_F(BsdfTest, albedosOfLobesAreTheirIntegrals) {
    // Of uniform light: all lobes that are not deltas, and the cosine lobe as what bsdfWithoutCosine lacks.
    const std::string body = R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i / push.perCase];
    const uint j = i % push.perCase;
    const Bsdf b = bsdfOf(c);
    const vec3 wi = sampleHemisphere((vec2(j % 128u, j / 128u) + 0.5) / 128.0);
    float pdf;
    push.result.v[4u * i] = bsdfEval(b, c.wo, wi, pdf).x / pdfSolidAngleHemisphere();
    push.result.v[4u * i + 1u] = bsdfEval(bsdfWithoutCosine(b), c.wo, wi, pdf).x / pdfSolidAngleHemisphere();
    push.result.v[4u * i + 2u] = bsdfSmoothAlbedo(b).x;
    push.result.v[4u * i + 3u] = bsdfCosineAlbedo(b).x;
})";
    std::vector<BsdfCase> cases;
    for (const float cosine : {1.0f, 0.5f})
        for (const float roughness : {0.0f, 0.5f, 1.0f})
            for (const float clearcoat : {0.0f, 1.0f})
                for (const float metallic : {0.0f, 1.0f})
                    cases.push_back({.baseColor = glm::vec3(0.7f),
                                     .metallic = metallic,
                                     .roughness = roughness,
                                     .clearcoat = clearcoat,
                                     .wo = directionAt(cosine)});
    constexpr uint32_t kDirections = 128 * 128;
    const Output out = run(body, cases, kDirections, size_t{4} * kDirections * cases.size());
    for (size_t k = 0; k < cases.size(); ++k) {
        SCOPED_TRACE(cases[k].describe());
        double all = 0, withoutCosine = 0;
        const float* first = &out.result[4 * kDirections * k];
        for (size_t j = 0; j < kDirections; ++j) {
            all += first[4 * j] / kDirections;
            withoutCosine += first[4 * j + 1] / kDirections;
        }
        // The layers' means are tables, good to a thousandth or two.
        EXPECT_NEAR(first[2], all, 0.002);
        EXPECT_NEAR(first[3], all - withoutCosine, 0.002);
    }
}

TEST_F(BsdfTest, importanceIsAdjointToRadiance) {
    constexpr uint32_t kDirections = 256;
    const auto cases = randomCases(256, {0.05f, 0.2f, 0.5f, 1}, {0.7f, 1, 1.1f, 1.5f, 2.4f});
    const Output out = run(R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i / push.perCase];
    const BsdfParams p = paramsOf(c);
    const Bsdf b = bsdfPrepare(p, c.wo, c.front != 0u);
    // Half of the directions from the BSDF, so that narrow lobes are seen.
    const vec3 u = vec3(pcg3d(uvec3(i, 2u, 9u)) >> 8) / 16777216.0;
    vec3 wi = sampleSphere(u.xy);
    if ((i & 1u) != 0u) wi = bsdfSample(b, c.wo, u).wi;
    const bool sameSide = wi.z * c.wo.z > 0.0;
    const bool frontOfWi = sameSide == (c.front != 0u);
    float pdf, pdfReverse;
    const vec3 f = bsdfEval(b, c.wo, wi, pdf) / max(abs(wi.z), 1e-6);
    const vec3 g = bsdfEval(bsdfPrepare(p, wi, frontOfWi, kTransportImportance), wi, c.wo, pdfReverse) / abs(c.wo.z);
    const float scale = maxComponent(max(f, g));
    push.result.v[3u * i] = abs(wi.z) > 1e-3 && scale > 1e-4 ? maxComponent(abs(f - g)) / scale : 0.0;
    push.result.v[3u * i + 1u] = abs(bsdfPdf(p, wi, c.wo, frontOfWi) - pdfReverse) / max(pdfReverse, 1.0);
    push.result.v[3u * i + 2u] = maxComponent(f) > 1e-6 && pdf == 0.0 ? 1.0 : 0.0;
})",
                           cases, kDirections, 3 * cases.size() * kDirections);
    for (size_t i = 0; i < cases.size() * kDirections; ++i) {
        ASSERT_LT(out.result[3 * i], 5e-3) << cases[i / kDirections].describe();
        ASSERT_LT(out.result[3 * i + 1], 1e-5) << cases[i / kDirections].describe();
        ASSERT_EQ(out.result[3 * i + 2], 0) << "light that sampling misses: " << cases[i / kDirections].describe();
    }
}

/// Nothing is ever infinite, negative or not a number, and weights stay within what the lobes can explain.
TEST_F(BsdfTest, extremesStayFinite) {
    constexpr uint32_t kDraws = 64;
    auto cases =
        randomCases(4096, {0, 1e-6f, 1e-4f, 0.01f, 0.0100001f, 0.011f, 0.02f, 0.1f, 0.5f, 1},
                    {0, 0.1f, 0.3f, 0.5f, 0.999f, 0.99999f, 1, 1.000001f, 1.0001f, 1.001f, 1.33f, 1.5f, 3, 10, 1e9f});
    const float cosines[] = {0, 1e-20f, 1e-7f, 1e-4f, 1e-2f, 1};
    for (size_t i = 0; i < cases.size(); i += 2)
        cases[i].wo = directionAt(cosines[i / 2 % std::size(cosines)]) * (i % 4 ? 1.0f : -1.0f);
    const Output out = run(R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i / push.perCase];
    const Bsdf b = bsdfOf(c);
    const vec3 u = vec3(pcg3d(uvec3(i, 2u, 10u)) >> 8) / 16777216.0;
    const BsdfSample s = bsdfSample(b, c.wo, i % 8u == 0u ? vec3(0.0) : i % 8u == 1u ? vec3(kOneMinusEpsilon) : u);
    vec3 wi = sampleSphere(u.yz);
    if (i % 4u == 1u) wi = vec3(1.0, 0.0, 0.0);
    if (i % 4u == 2u) wi = vec3(-c.wo.xy, c.wo.z);
    if (i % 4u == 3u) wi = -c.wo;
    float pdf;
    const vec3 f = bsdfEval(b, c.wo, wi, pdf);
    uint bad = 0u;
    if (!isFinite(f) || !isFinite(pdf) || minComponent(f) < 0.0 || pdf < 0.0) bad |= 1u;
    if (!isFinite(s.wi) || !isFinite(s.weight) || !isFinite(s.pdfSolidAngle) || minComponent(s.weight) < 0.0) bad |= 2u;
    if (!isFinite(bsdfAlbedo(b)) || !isFinite(bsdfDeltaProbability(b))) bad |= 4u;
    if ((s.flags & kBsdfValid) != 0u && (abs(length(s.wi) - 1.0) > 1e-4 || !(s.pdfSolidAngle > 0.0))) bad |= 8u;
    push.counts.v[i] = bad;
    push.result.v[i] = maxComponent(s.weight);
})",
                           cases, kDraws, cases.size() * kDraws, cases.size() * kDraws);
    for (size_t i = 0; i < out.counts.size(); ++i)
        ASSERT_EQ(out.counts[i], 0u) << cases[i / kDraws].describe() << ", clearcoat ior "
                                     << cases[i / kDraws].clearcoatIor;
}

/// Lobes just above the delta threshold send light where the delta does, with the same energy.
TEST_F(BsdfTest, thresholdIsContinuous) {
    for (const float transmission : {0.0f, 1.0f})
        for (const float cosine : {1.0f, 0.5f, 0.1f})
            for (const float uz : {0.01f, 0.3f, 0.99f}) {
                const BsdfCase smooth{.roughness = 0.01f, .transmission = transmission, .wo = directionAt(cosine)};
                BsdfCase rough = smooth;
                rough.roughness = 0.01001f;
                const std::vector<Sample> s = sample({smooth, rough}, uz);
                ASSERT_EQ(s[0].flags & ~kFlagDelta, s[1].flags & ~kFlagDelta);
                EXPECT_LT(glm::length(s[0].wi - s[1].wi), 2e-3) << smooth.describe();
                EXPECT_LT(glm::length(s[0].weight - s[1].weight), 5e-3) << smooth.describe();
                EXPECT_LT(glm::length(s[0].albedo - s[1].albedo), 1e-3) << smooth.describe();
            }
}

} // namespace
