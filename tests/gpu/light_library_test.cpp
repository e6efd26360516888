// Conventions of the light library and its behaviour at the edges: wrong sides, extreme sizes, exact selection.

#include "gpu/gpu_fixture.h"

#include "light/light_table.h"

#include <glm/gtc/matrix_transform.hpp>

#include <cmath>

namespace trilume {
namespace {

using glm::dmat4;
using glm::dvec3;
using glm::vec2;
using glm::vec3;

struct Query {
    shared::Light light;
    vec3 position;
    vec3 wi;
    vec3 point;
};

struct Answer {
    vec3 wi;
    float distance;
    vec3 radiance;
    float pdf;
    vec3 normal;
    float pdfAlongWi;
    vec3 radianceAlongWi;
    vec2 uv;
    vec2 uvOfPoint;
};

const std::string kKernel = R"(
#include "lib/light/light.glsl"
#include "lib/rng.glsl"
struct Query { Light light; vec3 position; vec3 wi; vec3 point; };
struct Answer {
    vec3 wi; float distance; vec3 radiance; float pdf; vec3 normal; float pdfAlongWi; vec3 radianceAlongWi; vec2 uv;
    vec2 uvOfPoint;
};
TL_DECLARE_REF(Query)
TL_DECLARE_REF(Answer)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { QueryRef queries; AnswerRef answers; DistributionRef none; uint count; uint samples; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count * push.samples) return;
    const Query q = push.queries.v[i / push.samples];
    const LightSample s = lightSample(q.light, push.none, q.position, unitFloat(pcg3d(uvec3(i, 3u, 5u)).xy));
    const vec2 uv = lightUv(q.light, q.point, q.wi);
    push.answers.v[i] = Answer(s.wi, s.distance, s.radiance, s.pdfSolidAngle, s.normal,
                               lightPdfSolidAngle(q.light, push.none, q.position, q.point, q.wi),
                               lightRadiance(q.light, q.wi, uv), s.uv, uv);
}
)";

struct Push {
    uint64_t queries, answers, none;
    uint32_t count, samples;
};

shared::Light build(const Light& component, const dmat4& worldFromLocal = dmat4(1)) {
    const LightInput input{.component = &component, .worldFromLocal = worldFromLocal};
    return buildLightTable(std::span(&input, 1), {}, dvec3(0), 1).lights.at(0);
}

shared::Light triangle(vec3 a, vec3 b, vec3 c, const dmat4& worldFromLocal = dmat4(1)) {
    Mesh mesh;
    mesh.positions = {a, b, c};
    mesh.triangles = {{0, 1, 2}};
    const EmissiveMeshInput input{
        .mesh = &mesh, .worldFromLocal = worldFromLocal, .radiance = [](uint32_t) { return vec3(1); }};
    return buildLightTable({}, std::span(&input, 1), dvec3(0), 1).lights.at(0);
}

class LightLibrary : public test::GpuTest {
protected:
    std::vector<Answer> ask(const std::vector<Query>& queries, uint32_t samples = 1) {
        const gpu::Buffer in = bufferOf(queries), out = bufferFor<Answer>(queries.size() * samples);
        runCompute(kKernel, Push{in.address(), out.address(), 0, uint32_t(queries.size()), samples},
                   uint32_t(queries.size() * samples));
        return read<Answer>(out, queries.size() * samples);
    }
    Answer ask(const Query& query) { return ask(std::vector{query}).at(0); }
};

TEST_F(LightLibrary, RectTextureStandsUprightSeenFromItsFront) {
    // UsdLux: the picture's upper left corner at (+x, +y), its lower right one at (-x, -y).
    const shared::Light rect = build({.kind = LightKind::Rect, .width = 2, .height = 4});
    const auto uv = [&](vec3 point) {
        return ask({rect, {0, 0, -3}, glm::normalize(point - vec3(0, 0, -3)), point}).uvOfPoint;
    };
    EXPECT_LT(glm::distance(uv({1, 2, 0}), vec2(0, 1)), 1e-5);
    EXPECT_LT(glm::distance(uv({-1, -2, 0}), vec2(1, 0)), 1e-5);
    EXPECT_LT(glm::distance(uv({0.5f, 0, 0}), vec2(0.25f, 0.5f)), 1e-5);
}

TEST_F(LightLibrary, DomeTextureFollowsOpenExr) {
    const shared::Light dome = build({.kind = LightKind::Dome});
    const auto uv = [&](vec3 wi) { return ask({dome, vec3(0), wi, vec3(0)}).uvOfPoint; };
    EXPECT_LT(glm::distance(uv({0, 0, 1}), vec2(0.5f, 0.5f)), 1e-5);
    EXPECT_LT(glm::distance(uv({1, 0, 0}), vec2(0.25f, 0.5f)), 1e-5);
    EXPECT_LT(glm::distance(uv({-1, 0, 0}), vec2(0.75f, 0.5f)), 1e-5);
    EXPECT_NEAR(uv({0, 1, 0}).y, 1, 1e-5);
    EXPECT_NEAR(uv({0, -1, 0}).y, 0, 1e-5);
    // Latitude -pi/4, longitude pi/4.
    EXPECT_LT(glm::distance(uv({0.5f, -std::sqrt(0.5f), 0.5f}), vec2(0.375f, 0.25f)), 1e-5);
}

TEST_F(LightLibrary, SampleUvIsThatOfThePointSeen) {
    const dmat4 turned = glm::rotate(glm::translate(dmat4(1), dvec3(1, 2, 3)), 0.7, dvec3(1, 2, 3));
    std::vector<Query> queries{{build({.kind = LightKind::Rect, .width = 2, .height = 4}, turned), {1, 1, 0}},
                               {build({.kind = LightKind::Dome}, turned), {1, 1, 0}},
                               {triangle({0, 0, 1}, {1, 0, 1}, {0, 2, 1}), {0.3f, 0.2f, 3}}};
    std::vector<Answer> answers = ask(queries, 64);
    std::vector<Query> again;
    for (size_t i = 0; i < answers.size(); ++i) {
        Query q = queries[i / 64];
        q.wi = answers[i].wi;
        q.point = q.position + answers[i].distance * q.wi;
        again.push_back(q);
    }
    const std::vector<Answer> seen = ask(again);
    for (size_t i = 0; i < answers.size(); ++i) {
        ASSERT_GT(answers[i].pdf, 0);
        EXPECT_LT(glm::distance(answers[i].uv, seen[i].uvOfPoint), 1e-4) << i;
    }
}

TEST_F(LightLibrary, NothingComesFromTheBack) {
    const shared::Light rect = build({.kind = LightKind::Rect}), disk = build({.kind = LightKind::Disk}),
                        sphere = build({.kind = LightKind::Sphere, .radius = 1}),
                        cylinder = build({.kind = LightKind::Cylinder, .radius = 1, .length = 1}),
                        face = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const vec3 up(0, 0, 1), down(0, 0, -1);
    const std::vector<Answer> answers = ask(std::vector<Query>{
        {rect, {0.1f, 0.1f, 2}, down, {0.1f, 0.1f, 0}},
        {disk, {0.1f, 0.1f, 2}, down, {0.1f, 0.1f, 0}},
        {face, {0.1f, 0.1f, -2}, up, {0.1f, 0.1f, 0}},
        {rect, {0.1f, 3, 0}, {0, -1, 0}, {0.1f, 0.5f, 0}}, // in its plane
        {disk, {0.1f, 3, 0}, {0, -1, 0}, {0.1f, 0.5f, 0}},
        {face, {0.1f, 3, 0}, {0, -1, 0}, {0.1f, 0.5f, 0}},
        {sphere, {0.1f, 0.2f, 0.3f}, up, {0.1f, 0.2f, 1}}, // inside
        {cylinder, {5, 0.2f, 0.3f}, {-1, 0, 0}, {0, 0.2f, 1}},
    });
    for (size_t i = 0; i < answers.size(); ++i) {
        EXPECT_EQ(answers[i].pdf, 0) << i;
        EXPECT_EQ(answers[i].pdfAlongWi, 0) << i;
        if (i < 6) {
            EXPECT_EQ(answers[i].radianceAlongWi, vec3(0)) << i;
        }
    }
    const shared::Light sun = build({.kind = LightKind::Distant, .angle = 2});
    EXPECT_EQ(ask({sun, vec3(0), {0, 0, 1}, vec3(0)}).radianceAlongWi, vec3(1));
    EXPECT_EQ(ask({sun, vec3(0), {0, std::sin(0.02f), std::cos(0.02f)}, vec3(0)}).radianceAlongWi, vec3(0));
    EXPECT_EQ(ask({build({.kind = LightKind::Distant, .angle = 0}), vec3(0), {0, 0, 1}, vec3(0)}).pdfAlongWi, 0);
}

TEST_F(LightLibrary, ExtremesStayFiniteAndBounded) {
    std::vector<Query> queries;
    for (const double scale : {1e-5, 1e-2, 1.0, 1e5}) {
        for (const double size : {1.0, 1e-3, 1e-6}) {
            const double s = scale * size;
            const dmat4 place = glm::scale(glm::translate(dmat4(1), scale * dvec3(0.3, -0.2, 0.1)), dvec3(s));
            const vec3 at = vec3(scale * dvec3(0.3, -0.2, 0.1));
            const std::vector<shared::Light> lights{
                build({.kind = LightKind::Rect}, place),
                build({.kind = LightKind::Rect, .width = 1, .height = 1e-4f}, place),
                build({.kind = LightKind::Disk}, place),
                build({.kind = LightKind::Sphere}, place),
                build({.kind = LightKind::Cylinder}, place),
                build({.kind = LightKind::Cylinder, .radius = 1e-4f}, place),
                triangle({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, place),
                triangle({0, 0, 0}, {0.5, 1e-5, 0}, {1, 0, 0}, place),
            };
            for (const shared::Light& light : lights) {
                for (const double distance : {1e-7, 1e-4, 0.1, 1.0, 30.0, 1e4, 1e8}) {
                    for (const dvec3 direction :
                         {dvec3(0, 0, -1), dvec3(1, 0, 0), dvec3(1, 2, -3), dvec3(1, 1, -1e-5), dvec3(0, 1, 1e-7)}) {
                        for (const double offset : {0.0, 0.25, 0.5, 0.50001}) {
                            const dvec3 p = dvec3(light.position) +
                                            s * (dvec3(offset, offset, 0) + distance * glm::normalize(direction));
                            queries.push_back({light, vec3(p), {0, 0, 1}, at});
                        }
                    }
                }
            }
        }
    }
    constexpr uint32_t kSamples = 16;
    const std::vector<Answer> answers = ask(queries, kSamples);
    size_t lit = 0;
    for (size_t i = 0; i < answers.size(); ++i) {
        const Answer& a = answers[i];
        const Query& q = queries[i / kSamples];
        const std::string where = "kind " + std::to_string(q.light.kind) + " query " + std::to_string(i / kSamples);
        ASSERT_TRUE(std::isfinite(a.pdf) && a.pdf >= 0) << where;
        if (a.pdf == 0) continue;
        ++lit;
        ASSERT_NEAR(glm::length(a.wi), 1, 1e-5) << where;
        ASSERT_NEAR(glm::length(a.normal), 1, 1e-4) << where;
        ASSERT_TRUE(std::isfinite(a.distance) && a.distance > 0) << where;
        // No fireflies: no sample weighs more than the hemisphere.
        ASSERT_LE(1 / a.pdf, 6.2832f) << where;
    }
    EXPECT_GT(lit, answers.size() / 4);
}

/// Van Oosterom & Strackee's solid angle in double precision.
double solidAngle(dvec3 a, dvec3 b, dvec3 c) {
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    return 2 * std::atan2(std::abs(glm::dot(a, glm::cross(b - a, c - a))),
                          la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(a, c) * lb);
}

TEST_F(LightLibrary, DensityKeepsRelativePrecisionHoweverSmallTheLight) {
    std::vector<Query> queries;
    std::vector<double> expected;
    for (const double size : {1.0, 1e-2, 1e-4, 1e-6}) {
        for (const vec3 p : {vec3(0.1f, 0.2f, -1), vec3(3, 2, -1), vec3(-0.5f, 4, -0.5f)}) {
            const dmat4 place = glm::scale(dmat4(1), dvec3(size));
            const auto to = [&](double x, double y) { return size * dvec3(x, y, 0) - dvec3(p); };
            queries.push_back({triangle({0, 0, 0}, {0, 1, 0}, {1, 0.5f, 0}, place), p, {0, 0, 1}, vec3(0)});
            expected.push_back(solidAngle(to(0, 0), to(0, 1), to(1, 0.5)));
            queries.push_back({build({.kind = LightKind::Rect}, place), p, {0, 0, 1}, vec3(0)});
            expected.push_back(solidAngle(to(-0.5, -0.5), to(0.5, -0.5), to(0.5, 0.5)) +
                               solidAngle(to(-0.5, -0.5), to(0.5, 0.5), to(-0.5, 0.5)));
        }
    }
    const std::vector<Answer> answers = ask(queries);
    for (size_t i = 0; i < answers.size(); ++i) EXPECT_NEAR(answers[i].pdfAlongWi * expected[i], 1, 5e-6) << i;
}

TEST_F(LightLibrary, SelectionIsExactlyTheTables) {
    constexpr uint32_t kDraws = 1 << 21;
    std::vector<Light> components(1000);
    std::vector<LightInput> inputs;
    for (size_t i = 0; i < components.size(); ++i) {
        components[i] = {.kind = LightKind::Rect, .radiance = vec3(float(1 + (i * 37) % 100))};
        inputs.push_back({.component = &components[i]});
    }
    const LightTable table = buildLightTable(inputs, {}, dvec3(0), 1);
    const gpu::Buffer alias = bufferOf(table.alias), counts = bufferOf(std::vector<uint32_t>(components.size(), 0));
    struct {
        uint64_t alias, counts;
        uint32_t lights, draws;
    } push{alias.address(), counts.address(), uint32_t(components.size()), kDraws};
    // Evenly spaced words in place of random ones, so that the count is exact up to the ends of each interval.
    runCompute(R"(
#include "lib/light/light.glsl"
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { AliasEntryRef alias; uintRef counts; uint lights; uint draws; } push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < push.draws) atomicAdd(push.counts.v[lightSelect(push.alias, push.lights, i * 2048u + 1024u)], 1u);
})",
               push, kDraws);
    std::vector<int> intervals(components.size(), 1);
    for (const shared::AliasEntry& e : table.alias) ++intervals[e.alias];
    const std::vector<uint32_t> drawn = read<uint32_t>(counts, components.size());
    for (size_t i = 0; i < drawn.size(); ++i) {
        EXPECT_NEAR(drawn[i], double(table.lights[i].selection) * kDraws, intervals[i] + 1) << i;
    }
}

} // namespace
} // namespace trilume
