#pragma once

#include "gpu/gpu_fixture.h"
#include "render/bsdf_tables.h"

#include <glm/glm.hpp>

namespace trilume::test {

/// A BSDF seen from a direction; the same struct in C++ and GLSL.
struct BsdfCase {
    glm::vec3 baseColor{0.8f};
    float metallic = 0;
    glm::vec3 specularColor{1};
    float roughness = 0.5f;
    glm::vec3 transmissionColor{1};
    float transmission = 0;
    float ior = 1.5f;
    float specular = 1;
    float clearcoat = 0, clearcoatRoughness = 0.01f, clearcoatIor = 1.5f;
    uint32_t specularWorkflow = 0;
    uint32_t front = 1;
    uint32_t importance = 0; ///< transport of importance rather than radiance
    glm::vec3 wo{0, 0, 1};

    std::string describe() const {
        return "metallic " + std::to_string(metallic) + " roughness " + std::to_string(roughness) + " transmission " +
               std::to_string(transmission) + " ior " + std::to_string(ior) + " clearcoat " +
               std::to_string(clearcoat) + " of roughness " + std::to_string(clearcoatRoughness) +
               (specularWorkflow ? " specular workflow" : "") + (front ? " front" : " back") + " cos " +
               std::to_string(wo.z);
    }
};

/// A unit vector at this cosine, off the axes in azimuth.
inline glm::vec3 directionAt(float cosine, float azimuth = 0.7f) {
    const float sine = std::sqrt(std::max(0.0f, 1 - cosine * cosine));
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

/// Runs kernels over BSDFs. A kernel is the body of `void main()`, with `i` the thread and what kPrelude declares.
class BsdfFixture : public GpuTest {
protected:
    static constexpr const char* kPrelude = R"(
#define TL_BSDF_TABLES push.tables
layout(local_size_x = 64) in;
struct Case {
    vec3 baseColor; float metallic;
    vec3 specularColor; float roughness;
    vec3 transmissionColor; float transmission;
    float ior, specular, clearcoat, clearcoatRoughness, clearcoatIor;
    uint specularWorkflow, front, importance;
    vec3 wo;
};
TL_DECLARE_REF(Case)
layout(push_constant, scalar) uniform Push {
    uintRef tables; CaseRef cases; floatRef result; uintRef counts; uint threads; uint perCase;
} push;
#include "lib/bsdf/bsdf.glsl"
#include "lib/rng.glsl"

BsdfParams paramsOf(Case c) {
    return BsdfParams(c.baseColor, c.metallic, c.specularColor, c.roughness, c.transmissionColor, c.transmission, c.ior,
                      c.specular, c.clearcoat, c.clearcoatRoughness, c.clearcoatIor, c.specularWorkflow != 0u);
}
Bsdf bsdfOf(Case c) { return bsdfPrepare(paramsOf(c), c.wo, c.front != 0u, c.importance); }
)";

    struct Push {
        VkDeviceAddress tables, cases, result, counts;
        uint32_t threads, perCase;
    };
    struct Output {
        std::vector<float> result;
        std::vector<uint32_t> counts;
    };

    /// `perCase` threads for each case; results and counts start at 0.
    Output run(const std::string& body, const std::vector<BsdfCase>& cases, uint32_t perCase, size_t results,
               size_t counts = 0, std::vector<std::pair<std::string, std::string>> defines = {}) {
        const gpu::Buffer tables = bufferOf(bsdfTables()), input = bufferOf(cases);
        const gpu::Buffer result = bufferOf(std::vector<float>(results)),
                          count = bufferOf(std::vector<uint32_t>(counts));
        const auto threads = uint32_t(cases.size()) * perCase;
        const Push push{tables.address(), input.address(), result.address(), count.address(), threads, perCase};
        runCompute(kPrelude + body, push, threads, std::move(defines));
        return {read<float>(result, results), read<uint32_t>(count, counts)};
    }
};

} // namespace trilume::test
