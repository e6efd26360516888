// Rays that lightEmit sends out: their densities against geometry in double precision, and their flux against closed
// forms.

#include "light_fixture.h"
#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

namespace trilume {
namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using std::numbers::pi;
using test::place;
using test::spottedTexture;

struct Sample {
    glm::vec3 origin, normal, direction;
    glm::vec2 uv;
    glm::vec3 radiance;
    float pdfPosition, pdfDirection;
    float pdfAgain; // both densities' product, from the functions that evaluate them
};

/// A point to evaluate the densities at.
struct Query {
    glm::vec3 normal;
    glm::vec2 uv;
    glm::vec3 direction;
};

const std::string kKernel = R"(
#include "lib/light/emit.glsl"
#include "lib/rng.glsl"
struct Sample {
    vec3 origin, normal, direction;
    vec2 uv;
    vec3 radiance;
    float pdfPosition, pdfDirection, pdfAgain;
};
struct Query { vec3 normal; vec2 uv; vec3 direction; };
TL_DECLARE_REF(Sample)
TL_DECLARE_REF(Query)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
    LightRef light;
    DistributionRef distributions;
    SampleRef samples;
    QueryRef queries;
    vec2Ref pdfs;
    vec3 boundsCenter;
    float boundsRadius;
    uint count;
    uint padding;
} push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    const Light light = push.light.v[0];
#ifdef SAMPLE
    const vec2 u = unitFloat(pcg3d(uvec3(i, 1u, 7u)).xy), v = unitFloat(pcg3d(uvec3(i, 2u, 7u)).xy);
    const EmittedRay r = lightEmit(light, push.distributions, push.boundsCenter, push.boundsRadius, u, v);
    const float area = r.infinite ? emitDiskPdf(push.boundsRadius)
                                  : lightEmitPdfArea(light, push.distributions, r.normal, r.uv);
    push.samples.v[i] = Sample(r.origin, r.normal, r.direction, r.uv, r.radiance, r.pdfPosition, r.pdfDirection,
                               area * lightEmitPdfDirection(light, push.distributions, r.normal, r.direction));
#else
    const Query q = push.queries.v[i];
    push.pdfs.v[i] = vec2(lightIsInfinite(light) ? 0.0 : lightEmitPdfArea(light, push.distributions, q.normal, q.uv),
                          lightEmitPdfDirection(light, push.distributions, q.normal, q.direction));
#endif
}
)";

struct Push {
    uint64_t light, distributions, samples, queries, pdfs;
    glm::vec3 boundsCenter;
    float boundsRadius;
    uint32_t count, padding = 0;
};

/// A parametrisation of something sampled by (s, t) in [0,1]^2, independent of how it is sampled.
struct Domain {
    struct Element {
        Query query;
        double measure; // area or solid angle per ds dt
    };
    std::function<Element(double s, double t)> at;
    std::function<dvec2(const Sample&)> inverse;
};

double turn(double y, double x) {
    const double angle = std::atan2(y, x) / (2 * pi);
    return angle < 0 ? angle + 1 : angle;
}

/// Points of a finite light.
Domain positionsOf(const shared::Light& light) {
    const dvec3 p(light.position), u(light.axisU), v(light.axisV);
    const auto inverseOf = [=](const dmat3& m) {
        return [p, inverse = glm::inverse(m)](const Sample& s) { return inverse * (dvec3(s.origin) - p); };
    };
    const double area = glm::length(glm::cross(u, v));
    const dmat3 plane(u, v, glm::normalize(glm::cross(u, v)));
    switch (light.kind) {
    case shared::kLightRect: // uv as seen from the emitting side
        return {[=](double s, double t) {
                    return Domain::Element{{light.normal, {1 - s, t}, light.normal}, area};
                },
                [=, local = inverseOf(plane)](const Sample& s) { return dvec2(local(s)) + 0.5; }};
    case shared::kLightTriangle:
        return {[=](double s, double t) {
                    const double r = std::sqrt(s);
                    return Domain::Element{{light.normal, {r * (1 - t), r * t}, light.normal}, area / 2};
                },
                [=, local = inverseOf(plane)](const Sample& s) {
                    const dvec3 b = local(s);
                    return dvec2((b.x + b.y) * (b.x + b.y), b.y / (b.x + b.y));
                }};
    case shared::kLightDisk:
        return {[=](double, double) {
                    return Domain::Element{{light.normal, {}, light.normal}, pi * area};
                },
                [=, local = inverseOf(plane)](const Sample& s) {
                    const dvec3 b = local(s);
                    return dvec2(b.x * b.x + b.y * b.y, turn(b.y, b.x));
                }};
    case shared::kLightSphere: {
        const dmat3 m(u, v, dvec3(light.normal) * double(light.radius));
        const dmat3 cofactor = glm::transpose(glm::inverse(m)) * std::abs(glm::determinant(m));
        return {[=](double s, double t) {
                    const double z = 2 * s - 1, r = std::sqrt(1 - z * z);
                    const dvec3 n = cofactor * dvec3(r * std::cos(2 * pi * t), r * std::sin(2 * pi * t), z);
                    const glm::vec3 normal(glm::normalize(n));
                    return Domain::Element{{normal, {}, normal}, 4 * pi * glm::length(n)};
                },
                [=, local = inverseOf(m)](const Sample& s) {
                    const dvec3 b = local(s);
                    return dvec2((b.z + 1) / 2, turn(b.y, b.x));
                }};
    }
    default: { // cylinder
        const dmat3 m(u, v, dvec3(light.normal) * double(light.radius));
        const dmat3 cofactor = glm::transpose(glm::inverse(m)) * std::abs(glm::determinant(m));
        return {[=](double, double t) {
                    const dvec3 n = cofactor * dvec3(0, std::cos(2 * pi * t), std::sin(2 * pi * t));
                    const glm::vec3 normal(glm::normalize(n));
                    return Domain::Element{{normal, {}, normal}, 2 * pi * glm::length(n)};
                },
                [=, local = inverseOf(m)](const Sample& s) {
                    const dvec3 b = local(s);
                    return dvec2(b.x + 0.5, turn(b.z, b.y));
                }};
    }
    }
}

/// The sphere of directions about the sample's normal (finite lights) or about the light's axis.
Domain directionsOf(const shared::Light& light) {
    const bool finite = light.kind != shared::kLightDistant && light.kind != shared::kLightDome;
    const auto frameAround = [](dvec3 n) {
        const dvec3 x = glm::normalize(glm::cross(std::abs(n.x) > 0.5 ? dvec3(0, 1, 0) : dvec3(1, 0, 0), n));
        return dmat3(x, glm::cross(n, x), n);
    };
    if (light.kind ==
        shared::kLightDome) { // longitude and latitude of -direction, which line up with a texture's texels
        const dmat3 frame(light.axisU, light.axisV, light.normal);
        return {[=](double s, double t) {
                    const double longitude = (0.5 - s) * 2 * pi, latitude = (t - 0.5) * pi;
                    const dvec3 w = frame * dvec3(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                                                  std::cos(latitude) * std::cos(longitude));
                    return Domain::Element{{{}, {}, glm::vec3(-w)}, 2 * pi * pi * std::cos(latitude)};
                },
                [=](const Sample& s) {
                    const dvec3 w = -dvec3(s.direction) * frame;
                    return dvec2(0.5 - std::atan2(w.x, w.z) / (2 * pi),
                                 0.5 + std::asin(std::clamp(w.y, -1.0, 1.0)) / pi);
                }};
    }
    // 1 - cos is uniform in s over the directions that can be sampled.
    const double range = finite ? 1 : light.radius;
    return {[=](double s, double t) {
                const double c = 1 - s * range, sine = std::sqrt(1 - c * c);
                const dvec3 w(sine * std::cos(2 * pi * t), sine * std::sin(2 * pi * t), c);
                return Domain::Element{{light.normal, {}, glm::vec3(frameAround(light.normal) * w)}, 2 * pi * range};
            },
            [=](const Sample& s) {
                const dvec3 w = dvec3(s.direction) * frameAround(finite ? s.normal : light.normal);
                return dvec2((w.x * w.x + w.y * w.y) / (1 + w.z) / range, turn(w.y, w.x));
            }};
}

class LightEmission : public test::LightTest {
protected:
    static constexpr uint32_t kCount = 1 << 16;
    static constexpr glm::vec3 kCenter{0.3f, -0.2f, 0.5f};
    static constexpr float kRadius = 1.7f;

    std::vector<Sample> sample(const shared::Light& light) {
        const gpu::Buffer lights = bufferOf(std::vector{light}), samples = bufferFor<Sample>(kCount);
        dispatch("SAMPLE", {lights.address(), distributions(), samples.address(), 0, 0, kCenter, kRadius, kCount});
        return read<Sample>(samples, kCount);
    }

    /// Samples fall into equal bins of the domain as often as the density says; it integrates to 1.
    void expectFollowsDensity(const shared::Light& light, const Domain& domain, const std::vector<Sample>& samples,
                              int which) {
        constexpr int kBins = 12, kPoints = 20, kGrid = kBins * kPoints; // per axis; points per bin
        std::vector<Query> queries;
        std::vector<double> measures, expected(kBins * kBins, 0.0), observed(kBins * kBins, 0.0);
        for (int i = 0; i < kGrid * kGrid; ++i) {
            const Domain::Element e = domain.at((i % kGrid + 0.5) / kGrid, (i / kGrid + 0.5) / kGrid);
            queries.push_back(e.query);
            measures.push_back(e.measure);
        }
        const gpu::Buffer lights = bufferOf(std::vector{light}), inputs = bufferOf(queries);
        const gpu::Buffer results = bufferFor<glm::vec2>(queries.size());
        dispatch("EVALUATE", {lights.address(), distributions(), 0, inputs.address(), results.address(), kCenter,
                              kRadius, uint32_t(queries.size())});
        const std::vector<glm::vec2> pdfs = read<glm::vec2>(results, queries.size());
        double integral = 0;
        for (int i = 0; i < kGrid * kGrid; ++i) {
            const double share = pdfs[i][which] * measures[i] / (kGrid * kGrid);
            expected[i / kGrid / kPoints * kBins + i % kGrid / kPoints] += share * kCount;
            integral += share;
        }
        EXPECT_NEAR(integral, 1.0, 2e-3);
        for (const Sample& s : samples) {
            const dvec2 st = glm::clamp(domain.inverse(s), 0.0, 1 - 1e-9);
            observed[int(st.y * kBins) * kBins + int(st.x * kBins)] += 1;
        }
        EXPECT_GT(test::chiSquaredTest(observed, expected), kSignificance);
    }

    /// Densities of position and direction, and the flux in all where it is told.
    void expectEmission(const std::string& name, const shared::Light& light, std::optional<double> flux = {}) {
        SCOPED_TRACE(name);
        const std::vector<Sample> samples = sample(light);
        const bool finite = light.kind != shared::kLightDistant && light.kind != shared::kLightDome;
        if (finite) expectFollowsDensity(light, positionsOf(light), samples, 0);
        if (finite || light.kind == shared::kLightDome || light.radius > 0)
            expectFollowsDensity(light, directionsOf(light), samples, 1);
        if (!finite) expectDisk(samples);

        double sum = 0, squares = 0;
        size_t different = 0;
        for (const Sample& s : samples) {
            different += !(std::abs(s.pdfAgain / (s.pdfPosition * s.pdfDirection) - 1) < 1e-3f);
            const double value =
                s.radiance.x * glm::dot(dvec3(s.normal), dvec3(s.direction)) / s.pdfPosition / s.pdfDirection;
            sum += value;
            squares += value * value;
        }
        EXPECT_LE(different, kCount / 1000);
        const double mean = sum / kCount, variance = std::max(0.0, squares / kCount - mean * mean);
        if (flux) {
            EXPECT_NEAR(mean, *flux, 4.5 * std::sqrt(variance / kCount) + 2e-4 * *flux);
        }
    }

    /// Uniform on the disk that touches the bounding sphere from outside; rays that miss nothing of the scene.
    void expectDisk(const std::vector<Sample>& samples) {
        constexpr size_t kCells = 64;
        std::vector<double> observed(kCells, 0.0);
        for (const Sample& s : samples) {
            const dvec3 offset = dvec3(s.origin) - dvec3(kCenter), d(s.direction);
            EXPECT_NEAR(glm::dot(offset, d), -kRadius, 1e-5);
            const double r2 = (glm::dot(offset, offset) - double(kRadius) * kRadius) / (double(kRadius) * kRadius);
            observed[size_t(std::clamp(r2, 0.0, 1 - 1e-9) * kCells)] += 1;
        }
        EXPECT_GT(test::chiSquaredTest(observed, std::vector(kCells, double(kCount) / kCells)), kSignificance);
    }

    // Of a run of all tests of this file: one in a thousand, shared by at most 60 chi-squared tests.
    static constexpr double kSignificance = 1e-3 / 60;

private:
    void dispatch(const char* define, const Push& push) {
        const gpu::Pipeline pipeline = compile(kKernel, {{define, "1"}});
        device().wait(device().submit([&](gpu::Commands& c) { c.dispatch(pipeline, push, push.count); }));
    }
};

TEST_F(LightEmission, PlanarLights) {
    const Light rect{.kind = LightKind::Rect, .width = 1.3f, .height = 0.7f};
    expectEmission("rect", build(rect, place({3, 2, 1}, dvec3(1), 40, {1, 1, 0})), pi * 0.7 * 1.3);
    dmat4 shear(1);
    shear[1] = {0.8, 1, 0, 0};
    expectEmission("sheared", build(rect, shear), pi * 0.7 * 1.3);
    expectEmission("mirrored", build(rect, place({0, 0, 0}, {-1, 1, 1})), pi * 0.7 * 1.3);
    expectEmission("triangle", triangle({0, 0, 0}, {1, 0.5, 0}, {0.25, 0.75, 0}), pi * 0.3125);
    const Light disk{.kind = LightKind::Disk, .radius = 0.5f};
    expectEmission("disk", build(disk, place({3, 2, 1}, dvec3(1), 40, {1, 1, 0})), pi * pi * 0.25);
    expectEmission("ellipse", build(disk, place({0, 0, 0}, {3, 0.5, 2})), pi * pi * 0.375);
    for (const double scale : {1e-5, 1e5})
        expectEmission("scaled", build(rect, place({0, 0, 0}, dvec3(scale))), pi * 0.7 * 1.3 * scale * scale);
}

TEST_F(LightEmission, CurvedLights) {
    const Light sphere{.kind = LightKind::Sphere, .radius = 0.5f};
    const Light cylinder{.kind = LightKind::Cylinder, .radius = 0.2f, .length = 1.5f};
    expectEmission("sphere", build(sphere, place({3, 2, 1})), pi * pi);
    expectEmission("cylinder", build(cylinder, place({3, 2, 1}, dvec3(1), 40, {1, 1, 0})), pi * 0.6 * pi);
    for (const double scale : {1e-5, 1e5}) {
        expectEmission("scaled sphere", build(sphere, place({0, 0, 0}, dvec3(scale))), pi * pi * scale * scale);
        expectEmission("scaled cylinder", build(cylinder, place({0, 0, 0}, dvec3(scale))),
                       0.6 * pi * pi * scale * scale);
    }
    // Stretched: not uniform by area.
    const shared::Light ellipsoid = build(sphere, place({0, 0, 0}, {2, 0.5, 1}, 30, {1, 2, 3}));
    expectEmission("ellipsoid", ellipsoid, pi * ellipsoid.area);
    const shared::Light oval = build(cylinder, place({0, 0, 0}, {2, 0.5, 3}, 30, {1, 2, 3}));
    expectEmission("oval cylinder", oval, pi * oval.area);
}

TEST_F(LightEmission, LightsAtInfinity) {
    const dmat4 turned = place({0, 0, 0}, dvec3(1), 70, {1, 2, -1});
    const double disk = pi * kRadius * kRadius;
    for (const double angle : {0.53, 20.0, 180.0, 300.0}) {
        const double oneMinusCos = 1 - std::cos(glm::radians(angle / 2));
        expectEmission("distant", build({.kind = LightKind::Distant, .angle = float(angle)}, turned),
                       2 * pi * oneMinusCos * disk);
    }
    expectEmission("one direction", build({.kind = LightKind::Distant, .radiance = glm::vec3(3), .angle = 0}, turned),
                   3 * disk);
    expectEmission("dome", build({.kind = LightKind::Dome}, turned), 4 * pi * disk);
}

TEST_F(LightEmission, TexturedLights) {
    // 12 x 6 texels line up with the bins, so that the quadrature sees a smooth density in each.
    setTexture(spottedTexture(12, 6), TextureDomain::LatLong);
    expectEmission("dome", build({.kind = LightKind::Dome}, place({0, 0, 0}, dvec3(1), 70, {1, 2, -1}), true));
    setTexture(spottedTexture(12, 6), TextureDomain::Rect);
    expectEmission("rect", build({.kind = LightKind::Rect, .width = 1.3f, .height = 0.7f}, dmat4(1), true));
}

} // namespace
} // namespace trilume
