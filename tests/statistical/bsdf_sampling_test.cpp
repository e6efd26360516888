// Samples of the BSDF library against its densities, and the energy that it sends back.

#include "gpu/bsdf_fixture.h"
#include "statistics.h"

using namespace trilume;
using namespace trilume::test;

namespace {

constexpr uint32_t kThreads = 256;          // per case
constexpr uint32_t kSamplesPerThread = 512; // 2^17 per case
constexpr double kSamples = double(kThreads) * kSamplesPerThread;
constexpr int kRings = 32, kSectors = 16, kCells = kRings * kSectors;
constexpr double kOverallSignificance = 1e-3;

// Cells around an axis, the direction of mirror reflection or of smooth refraction, fine near it: theta = pi s^4, so
// that lobes of any width spread over many cells.
const char* const kCellCode = R"(
const uint kRings = 32, kSectors = 16;
vec3 axisOf(Case c, bool refracted) {
    const vec3 mirrored = vec3(-c.wo.xy, c.wo.z);
    if (!refracted) return mirrored;
    const float eta = c.front != 0u ? c.ior : 1.0 / c.ior;
    const vec2 sideways = -c.wo.xy / eta;
    const float z = sqrt(max(1.0 - dot(sideways, sideways), 0.0));
    return normalize(vec3(sideways, c.wo.z > 0.0 ? -z : z));
}
)";

class BsdfSampling : public BsdfFixture {
protected:
    /// Fraction of samples in each cell of the axis's hemisphere, expected and observed; deltas excluded.
    void expectSamplesFollowDensity(const std::vector<BsdfCase>& cases, bool refracted) {
        const std::string axis = std::string("vec3 axis = axisOf(c, ") + (refracted ? "true" : "false") + ");\n";
        const Output drawn = run(std::string(kCellCode) + R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const uint which = i / push.perCase;
    const Case c = push.cases.v[which];
    const Bsdf b = bsdfOf(c);
)" + axis + R"(
    const mat3 frame = basisAround(axis);
    for (uint k = 0u; k < 512u; ++k) {
        Sampler rng = samplerInit(uvec2(i, 0u), k, 1u, kSamplerIndependent);
        const BsdfSample s = bsdfSample(b, c.wo, sample3D(rng));
        if ((s.flags & kBsdfValid) == 0u || (s.flags & kBsdfDelta) != 0u || s.wi.z * axis.z <= 0.0) continue;
        const vec3 d = s.wi * frame;
        const float theta = 2.0 * asin(min(0.5 * length(s.wi - axis), 1.0));
        const uint ring = min(uint(sqrt(sqrt(theta / kPi)) * float(kRings)), kRings - 1u);
        const uint sector = min(uint((atan(d.y, d.x) / kTwoPi + 0.5) * float(kSectors)), kSectors - 1u);
        atomicAdd(push.counts.v[which * kRings * kSectors + ring * kSectors + sector], 1u);
    }
})",
                                 cases, kThreads, 0, cases.size() * kCells);
        const Output integrals = run(std::string(kCellCode) + R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i / push.perCase];
    const Bsdf b = bsdfOf(c);
)" + axis + R"(
    const mat3 frame = basisAround(axis);
    const uint cell = i % push.perCase;
    const uint kAcross = 24u, kAround = 128u; // at grazing angles narrow lobes are narrower still across
    float sum = 0.0;
    for (uint y = 0u; y < kAcross; ++y) {
        float row = 0.0;
        for (uint x = 0u; x < kAround; ++x) {
            const float s = (float(cell / kSectors) + (float(y) + 0.5) / float(kAcross)) / float(kRings);
            const float phi = ((float(cell % kSectors) + (float(x) + 0.5) / float(kAround)) / float(kSectors) - 0.5) * kTwoPi;
            const float theta = kPi * s * s * s * s;
            const vec3 wi = frame * vec3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
            if (wi.z * axis.z <= 0.0) continue;
            float pdf;
            bsdfEval(b, c.wo, wi, pdf);
            row += pdf * sin(theta) * 4.0 * kPi * s * s * s;
        }
        sum += row;
    }
    push.result.v[i] = sum / float(kAcross * kAround * kRings * kSectors) * kTwoPi;
})",
                                     cases, kCells, cases.size() * kCells);
        const double significance = sidak(kOverallSignificance, double(cases.size()));
        for (size_t k = 0; k < cases.size(); ++k) {
            std::vector<double> observed, expected;
            double otherObserved = kSamples, otherExpected = kSamples;
            for (size_t cell = k * kCells; cell < (k + 1) * kCells; ++cell) {
                observed.push_back(drawn.counts[cell]);
                expected.push_back(kSamples * integrals.result[cell]);
                otherObserved -= observed.back();
                otherExpected -= expected.back();
            }
            observed.push_back(otherObserved);
            expected.push_back(std::max(otherExpected, 0.0));
            EXPECT_GT(chiSquaredTest(observed, expected), significance)
                << (refracted ? "refraction: " : "reflection: ") << cases[k].describe() << ": in the hemisphere "
                << kSamples - otherObserved << ", expected " << kSamples - otherExpected;
        }
    }

    struct Energy {
        double mean, error; ///< of the sample weights' average over colours, with its standard error
    };
    std::vector<Energy> energies(const std::vector<BsdfCase>& cases) {
        const Output out = run(R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.threads) return;
    const Case c = push.cases.v[i / push.perCase];
    const Bsdf b = bsdfOf(c);
    float sum = 0.0;
    for (uint k = 0u; k < 512u; ++k) {
        Sampler rng = samplerInit(uvec2(i, 0u), k, 2u, kSamplerSobol);
        const BsdfSample s = bsdfSample(b, c.wo, sample3D(rng));
        if ((s.flags & kBsdfValid) != 0u) sum += (s.weight.x + s.weight.y + s.weight.z) / 3.0;
    }
    push.result.v[i] = sum / 512.0;
})",
                               cases, kThreads, cases.size() * kThreads);
        std::vector<Energy> result;
        for (size_t k = 0; k < cases.size(); ++k) {
            double sum = 0, squares = 0;
            for (size_t i = k * kThreads; i < (k + 1) * kThreads; ++i) {
                sum += out.result[i];
                squares += double(out.result[i]) * out.result[i];
            }
            const double mean = sum / kThreads;
            result.push_back({mean, std::sqrt(std::max(squares / kThreads - mean * mean, 0.0) / (kThreads - 1))});
        }
        return result;
    }

    /// Lossless surfaces in a uniform field of radiance (per index squared) show that radiance, within `tolerance`.
    void expectWhite(const std::vector<BsdfCase>& cases, double tolerance) {
        const std::vector<Energy> found = energies(cases);
        double worst = 0;
        for (size_t k = 0; k < cases.size(); ++k) {
            EXPECT_NEAR(found[k].mean, 1, tolerance + 4 * found[k].error) << cases[k].describe();
            worst = std::max(worst, std::abs(found[k].mean - 1));
        }
        RecordProperty("worst", std::to_string(worst));
        std::printf("    worst deviation from white: %.4f\n", worst);
    }
};

const float kRoughnesses[] = {0, 0.01f, 0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.7f, 0.8f, 0.9f, 1};
const float kCosines[] = {1, 0.9f, 0.7f, 0.5f, 0.3f, 0.2f, 0.1f, 0.05f};

/// Every roughness seen under every angle.
std::vector<BsdfCase> sweep(BsdfCase base, bool coat = false) {
    std::vector<BsdfCase> cases;
    for (const float roughness : kRoughnesses)
        for (const float cosine : kCosines) {
            (coat ? base.clearcoatRoughness : base.roughness) = roughness;
            base.wo = directionAt(cosine) * (base.front ? 1.0f : -1.0f);
            cases.push_back(base);
        }
    return cases;
}

std::vector<BsdfCase> layeredCases(std::vector<float> roughnesses) {
    std::vector<BsdfCase> cases;
    for (const float roughness : roughnesses)
        for (const float cosine : {1.0f, 0.6f, 0.1f, 0.01f}) {
            const glm::vec3 wo = directionAt(cosine);
            cases.push_back({.roughness = roughness, .wo = wo});
            cases.push_back({.metallic = 1, .roughness = roughness, .wo = wo});
            cases.push_back({.metallic = 0.3f, .roughness = roughness, .wo = -wo});
            cases.push_back({.specularColor = glm::vec3(0.3f, 0.1f, 0.5f),
                             .roughness = roughness,
                             .specularWorkflow = 1,
                             .wo = wo});
            cases.push_back({.roughness = roughness, .clearcoat = 1, .clearcoatRoughness = 0.3f, .wo = wo});
            cases.push_back({.roughness = roughness, .transmission = 1, .wo = wo});
            cases.push_back({.roughness = roughness, .transmission = 1, .front = 0, .wo = -wo});
            cases.push_back({.metallic = 0.2f,
                             .roughness = roughness,
                             .transmissionColor = glm::vec3(0.9f, 0.5f, 0.2f),
                             .transmission = 0.6f,
                             .ior = 1.2f,
                             .clearcoat = 0.5f,
                             .clearcoatRoughness = 0.5f,
                             .front = 0,
                             .wo = -wo});
            cases.push_back({.roughness = roughness, .transmission = 1, .ior = 0.8f, .wo = wo});
            cases.push_back({.roughness = roughness, .transmission = 1, .ior = 2.5f, .wo = wo});
        }
    return cases;
}

TEST_F(BsdfSampling, reflectionFollowsItsDensity) {
    expectSamplesFollowDensity(layeredCases({0.02f, 0.1f, 0.35f, 0.7f, 1}), false);
}

TEST_F(BsdfSampling, refractionFollowsItsDensity) {
    std::vector<BsdfCase> cases = layeredCases({0.02f, 0.1f, 0.35f, 0.7f, 1});
    std::erase_if(cases, [](const BsdfCase& c) { return c.transmission == 0; });
    expectSamplesFollowDensity(cases, true);
}

TEST_F(BsdfSampling, whiteConductorLosesNothing) {
    expectWhite(sweep({.baseColor = glm::vec3(1), .metallic = 1}), 0.01);
}

TEST_F(BsdfSampling, whiteBaseUnderDielectricLosesNothing) {
    for (const float ior : {1.0f, 1.1f, 1.33f, 1.5f, 2.0f, 3.0f}) {
        SCOPED_TRACE(ior);
        expectWhite(sweep({.baseColor = glm::vec3(1), .ior = ior}), 0.01);
    }
    for (const float f0 : {0.01f, 0.3f, 0.9f, 1.0f}) {
        SCOPED_TRACE(f0);
        expectWhite(sweep({.baseColor = glm::vec3(1), .specularColor = glm::vec3(f0), .specularWorkflow = 1}), 0.01);
    }
}

TEST_F(BsdfSampling, clearDielectricLosesNothing) {
    for (const float ior : {1.2f, 1.33f, 1.5f, 2.0f, 3.0f, 0.7f})
        for (const uint32_t front : {0u, 1u}) {
            SCOPED_TRACE(ior);
            expectWhite(sweep({.transmission = 1, .ior = ior, .front = front, .importance = 1}), 0.01);
        }
}

TEST_F(BsdfSampling, clearcoatOnWhiteLosesNothing) {
    for (const float roughness : {0.0f, 0.3f, 1.0f}) {
        SCOPED_TRACE(roughness);
        expectWhite(sweep({.baseColor = glm::vec3(1), .roughness = roughness, .clearcoat = 1}, true), 0.01);
        expectWhite(sweep({.baseColor = glm::vec3(1), .roughness = roughness, .ior = 1, .clearcoat = 0.5f}, true),
                    0.01);
    }
}

TEST_F(BsdfSampling, clearcoatOnWhiteMetalLosesNothing) {
    for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
        SCOPED_TRACE(roughness);
        const BsdfCase metal{.baseColor = glm::vec3(1), .metallic = 1, .roughness = roughness, .clearcoat = 1};
        expectWhite(sweep(metal, true), 0.01);
    }
    expectWhite(sweep({.baseColor = glm::vec3(1), .metallic = 0.5f, .roughness = 0.4f, .clearcoat = 0.5f}, true), 0.01);
    for (const float ior : {1.3f, 2.0f}) {
        SCOPED_TRACE(ior);
        expectWhite(sweep({.baseColor = glm::vec3(1), .metallic = 1, .clearcoat = 1, .clearcoatIor = ior}, true), 0.01);
    }
}

TEST_F(BsdfSampling, nothingGainsEnergy) {
    std::vector<BsdfCase> cases;
    for (const float roughness : {0.0f, 0.05f, 0.3f, 0.6f, 1.0f})
        for (const float coat : {0.0f, 0.5f, 1.0f})
            for (const float metallic : {0.0f, 0.5f, 1.0f})
                for (const float transmission : {0.0f, 0.5f, 1.0f})
                    for (const float cosine : {1.0f, 0.4f, 0.15f, 0.05f})
                        for (const float sign : {1.0f, -1.0f})
                            cases.push_back({.baseColor = glm::vec3(1),
                                             .metallic = metallic,
                                             .roughness = roughness,
                                             .transmission = transmission,
                                             .ior = 1.5f,
                                             .clearcoat = coat,
                                             .clearcoatRoughness = 0.4f,
                                             .front = sign > 0,
                                             .importance = 1,
                                             .wo = sign * directionAt(cosine)});
    const std::vector<Energy> found = energies(cases);
    for (size_t k = 0; k < cases.size(); ++k)
        EXPECT_LE(found[k].mean, 1.01 + 4 * found[k].error) << cases[k].describe();
}

} // namespace
