// Boxes that hold surfaces are never called empty, and few of the others are missed.
#include "bench/tracer/harness.h"
#include "gpu/gpu_fixture.h"

#include <random>

namespace trilume::test {
namespace {

constexpr uint32_t kBoxes = 4000;

constexpr const char* kKernel = R"(
#include "shared/scene.h"
struct Box { vec3 center, extent; };
TL_DECLARE_REF(Box)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SceneTableRef scene; BoxRef boxes; uintRef empty; uint count, mask; };
#define TL_SCENE scene.v[0]
#include "scene/box_query.glsl"
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < count) empty.v[i] = boxIsEmpty(boxes.v[i].center, boxes.v[i].extent, mask) ? 1 : 0;
}
)";

struct Box {
    glm::vec3 center, extent;
    bool holds(glm::vec3 p, float scale) const { return glm::all(glm::lessThan(glm::abs(p - center), scale * extent)); }
};

class BoxQuery : public GpuTest, public testing::WithParamInterface<gpu::Tracer> {
protected:
    void SetUp() override {
        GpuTest::SetUp();
        if (GetParam() == gpu::Tracer::Query && !device().rayQuery()) GTEST_SKIP() << "no ray queries on this device";
    }

    float uniform(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
    glm::vec3 vector(float size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
    glm::mat4x3 placed(float size) {
        const glm::mat3 linear(glm::vec3(1, 0, 0) + vector(0.6f), glm::vec3(0, 1, 0) + vector(0.6f),
                               glm::vec3(0, 0, 1) + vector(0.6f));
        glm::mat4x3 m(size * uniform(0.3f, 1.5f) * linear);
        m[3] = size * vector(4.0f);
        return m;
    }

    std::mt19937 random_{1};
};

TEST_P(BoxQuery, IsConservativeAndTight) {
    for (const float size : {1e-3f, 1.0f, 1e3f}) {
        SCOPED_TRACE(size);
        std::vector<glm::vec3> corners;
        std::vector<glm::uvec3> triangles;
        for (uint32_t i = 0; i < 60; ++i) {
            const glm::vec3 center = vector(1.0f);
            for (int c = 0; c < 3; ++c) corners.push_back(center + vector(i % 6 == 0 ? 0.8f : 0.1f));
            triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        }
        TraceScene scene(device(), GetParam());
        const rt::MeshAccelId mesh = scene.accel.addMesh(corners, triangles, false, "soup");
        for (uint32_t i = 0; i < 20; ++i) {
            const uint32_t shape = i % 5;
            const uint32_t mask = i % 7 == 6 ? shared::kMaskCamera : shared::kMaskAll;
            scene.instances.push_back(
                {shape, shape == shared::kShapeMesh ? mesh : rt::MeshAccelId{}, placed(size), mask});
        }
        scene.commit();

        std::vector<Box> boxes;
        for (uint32_t i = 0; i < kBoxes; ++i) {
            const glm::vec3 extent = size * uniform(0.2f, 1.5f) * (glm::vec3(0.6f) + vector(0.4f));
            boxes.push_back({size * vector(5.0f), extent});
        }
        // Points of surfaces: where rays into each box end.
        std::vector<TraceRay> rays;
        for (uint32_t i = 0; i < 64 * kBoxes; ++i) {
            const Box& box = boxes[i / 64];
            const glm::vec3 from = box.center + box.extent * vector(1.0f);
            rays.push_back({from, 0.0f, box.extent * vector(1.0f)});
        }
        const std::vector<TraceHit> hits = scene.trace(rays, false, shared::kMaskIndirect);

        const gpu::Buffer input = bufferOf(boxes), output = bufferFor<uint32_t>(kBoxes);
        struct Push {
            VkDeviceAddress scene, boxes, empty;
            uint32_t count, mask;
        };
        std::vector<std::pair<std::string, std::string>> defines;
        if (GetParam() == gpu::Tracer::Query) defines.emplace_back("TL_TRACER_QUERY", "1");
        runCompute(kKernel, Push{scene.table(), input.address(), output.address(), kBoxes, shared::kMaskIndirect},
                   kBoxes, defines);
        const std::vector<uint32_t> empty = read<uint32_t>(output, kBoxes);

        uint32_t wrong = 0, held = 0, free = 0, found = 0;
        for (uint32_t i = 0; i < kBoxes; ++i) {
            bool inside = false, near = false;
            for (uint32_t k = 64 * i; k < 64 * (i + 1); ++k) {
                if (hits[k].instance == shared::kNone) continue;
                const glm::vec3 p = rays[k].origin + hits[k].t * rays[k].direction;
                inside = inside || boxes[i].holds(p, 0.999f);
                near = near || boxes[i].holds(p, 1.5f);
            }
            held += inside;
            wrong += inside && empty[i] != 0;
            free += !near;
            found += !near && empty[i] != 0;
        }
        EXPECT_EQ(wrong, 0u) << "of " << held;
        EXPECT_GT(held, kBoxes / 10);
        EXPECT_GT(free, kBoxes / 10);
        if (GetParam() == gpu::Tracer::Query)
            EXPECT_EQ(found, 0u) << "ray queries cannot tell";
        else
            EXPECT_GT(found, free * 4 / 5) << "of " << free;
    }
}

INSTANTIATE_TEST_SUITE_P(Tracers, BoxQuery, testing::Values(gpu::Tracer::Compute, gpu::Tracer::Query),
                         [](const auto& info) { return info.param == gpu::Tracer::Query ? "query" : "compute"; });

} // namespace
} // namespace trilume::test
