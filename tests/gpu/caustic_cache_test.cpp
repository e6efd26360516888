// The caustic cache gives back the energy that landed, on surfaces at any angle, and none of it elsewhere.

#include "gpu/gpu_fixture.h"

#include "shared/caustics.h"

#include <numeric>

namespace trilume {
namespace {

using glm::vec3;

/// A unit of flux lands on part of a surface; the cache is then read all over the surface.
enum Surface : uint32_t { TiltedSquare, SquareOnCellBorders, Sphere, SlopedRoof, StackedSquares };

struct Push {
    VkDeviceAddress frame, cache, sums, irradiance;
    uint32_t surface, count, lowerSheet;
};

const std::string kCommon = R"(
layout(local_size_x = 64) in;
#include "shared/caustics.h"
layout(push_constant, scalar) uniform Block {
    FrameConstantsRef frame; CausticPatchRef cache; uintRef sums; vec3Ref irradiance; uint surface; uint count; uint lowerSheet;
} push;
#include "lib/fixed_point.glsl"
#include "lib/rng.glsl"
#include "lib/sampling.glsl"
#include "scene/caustic_cache.glsl"

// u: [-1,1]^2, uniform by area; the squares have sides of 2, the sphere a radius of 1.
void surfacePoint(vec2 u, out vec3 position, out vec3 normal) {
    mat3 frame = basisAround(normalize(vec3(0.3, 0.5, 0.8)));
    position = vec3(u, 0.1);
    normal = vec3(0.0, 0.0, 1.0);
    if (push.surface == 1u) frame = mat3(1.0);
    if (push.surface == 1u) position.z = 6.0 * kCausticPatchSize * push.frame.v[0].scene.boundsRadius;
    if (push.surface == 2u) normal = sampleSphere(0.5 * u + 0.5);
    if (push.surface == 2u) position = normal;
    if (push.surface == 3u) normal = normalize(vec3(u.x > 0.0 ? 1.0 : -1.0, 0.0, 1.0));
    if (push.surface == 3u) position = vec3(sqrt(0.5) * u.x, u.y, -sqrt(0.5) * abs(u.x));
    if (push.surface == 4u) frame = mat3(1.0);
    position = frame * position;
    normal = frame * normal;
    if (push.lowerSheet != 0u) position -= 0.25 * normal;
}
vec2 random(uint i, uint salt) { return unitFloat(pcg3d(uvec3(i, salt, 7u)).xy); }
)";

const std::string kDeposit = kCommon + R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    vec3 position, normal;
    surfacePoint(0.7 * sampleDisk(random(i, 1u)), position, normal);
    const CausticPlace place = causticPlace(5u, position, normal);
    const uint slot = insertCausticPatch(push.cache, causticPatchHash(place));
    fixedAtomicAdd(push.sums, kFixedWords * slot, vec3(place.inverseArea / float(push.count)));
}
)";

const std::string kResolve = kCommon + R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < kCausticPatches) push.cache.v[i].irradiance = fixedColor(push.sums, kFixedWords * i);
}
)";

const std::string kLookup = kCommon + R"(
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    vec3 position, normal;
    surfacePoint(2.0 * random(i, 2u) - 1.0, position, normal);
    push.irradiance.v[i] = cachedCaustic(push.cache, 5u, position, normal).irradiance;
}
)";

class CausticCache : public test::GpuTest {
protected:
    static constexpr uint32_t kCount = 1 << 18;

    /// Flux read from a surface of the given area on which a flux of 1 has landed; from the sheet below it: `lower`.
    double flux(Surface surface, double area, bool lower = false) {
        shared::FrameConstants constants{};
        constants.scene.boundsRadius = 1.7f;
        const gpu::Buffer frame = bufferOf<shared::FrameConstants>({constants});
        const gpu::Buffer cache = bufferOf(std::vector<shared::CausticPatch>(shared::kCausticPatches));
        const gpu::Buffer sums = bufferOf(std::vector<uint32_t>(6 * shared::kCausticPatches));
        const gpu::Buffer irradiance = bufferFor<vec3>(kCount);
        Push push{frame.address(), cache.address(), sums.address(), irradiance.address(), surface, kCount, 0};
        runCompute(kDeposit, push, kCount);
        runCompute(kResolve, push, shared::kCausticPatches);
        push.lowerSheet = lower ? 1 : 0;
        runCompute(kLookup, push, kCount);
        double sum = 0;
        for (const vec3 e : read<vec3>(irradiance, kCount)) sum += e.x;
        return sum * area / kCount;
    }
};

// The lookups' standard deviation is about 1.5 times their mean: 0.3% over this many; within five of those.
TEST_F(CausticCache, ReturnsTheFluxThatLanded) {
    EXPECT_NEAR(flux(TiltedSquare, 4), 1, 0.015);
    EXPECT_NEAR(flux(SquareOnCellBorders, 4), 1, 0.015);
}

// Where two faces meet, or a round one turns to another axis, squares of the grid are cut: what they lack is lost.
TEST_F(CausticCache, LosesLittleAtEdges) {
    for (const double kept : {flux(SlopedRoof, 4), flux(Sphere, 4 * M_PI)}) {
        EXPECT_LT(kept, 1.01);
        EXPECT_GT(kept, 0.95);
    }
}

TEST_F(CausticCache, LightsNoSheetButTheOneThatLightFellOn) {
    EXPECT_NEAR(flux(StackedSquares, 4), 1, 0.015);
    EXPECT_EQ(flux(StackedSquares, 4, true), 0);
}

} // namespace
} // namespace trilume
