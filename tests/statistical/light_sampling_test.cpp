// Directions that lightSample draws, against lightPdfSolidAngle and against geometry in double precision.

#include "light_fixture.h"
#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

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
    glm::vec3 wi;
    float distance;
    glm::vec3 radiance;
    float pdf;
    glm::vec3 normal;
    float pdfEvaluated;
    glm::vec2 uv;
};

struct Direction {
    glm::vec3 wi;
    glm::vec3 point;
};

const std::string kKernel = R"(
#include "lib/light/light.glsl"
#include "lib/rng.glsl"
struct Sample { vec3 wi; float distance; vec3 radiance; float pdf; vec3 normal; float pdfEvaluated; vec2 uv; };
struct Direction { vec3 wi; vec3 point; };
TL_DECLARE_REF(Sample)
TL_DECLARE_REF(Direction)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push {
    LightRef light;
    DistributionRef distributions;
    SampleRef samples;
    DirectionRef directions;
    floatRef pdfs;
    vec3 position;
    uint count;
    uint seed;
    uint padding;
} push;
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) return;
    const Light light = push.light.v[0];
#ifdef SAMPLE
    const vec2 u = unitFloat(pcg3d(uvec3(i, push.seed, 7u)).xy);
    const LightSample s = lightSample(light, push.distributions, push.position, u);
    const float pdf = lightPdfSolidAngle(light, push.distributions, push.position, push.position + s.wi * s.distance, s.wi);
    push.samples.v[i] = Sample(s.wi, s.distance, s.radiance, s.pdfSolidAngle, s.normal, pdf, s.uv);
#else
    const Direction d = push.directions.v[i];
    push.pdfs.v[i] = lightPdfSolidAngle(light, push.distributions, push.position, d.point, d.wi);
#endif
}
)";

struct Push {
    uint64_t light, distributions, samples, directions, pdfs;
    glm::vec3 position;
    uint32_t count, seed, padding = 0;
};

/// A parametrisation of the directions in which a light is seen, (s, t) in [0,1]^2, independent of how it is sampled.
struct Domain {
    struct Element {
        dvec3 wi, point;
        double measure; // d(solid angle) / (ds dt)
    };
    std::function<Element(double s, double t)> at;
    std::function<dvec2(const Sample&)> inverse;
};

double wrapped(double angle) { return angle < 0 ? angle + 2 * pi : angle; }

dmat3 frameAround(dvec3 n) {
    const dvec3 x = glm::normalize(glm::cross(std::abs(n.x) > 0.5 ? dvec3(0, 1, 0) : dvec3(1, 0, 0), n));
    return {x, glm::cross(n, x), n};
}

/// Of a planar light with area element `area` per ds dt.
Domain::Element planarElement(const shared::Light& light, dvec3 eye, dvec3 point, double area) {
    const dvec3 to = point - eye;
    const double d = glm::length(to);
    return {to / d, point, area * std::max(0.0, -glm::dot(to, dvec3(light.normal)) / d) / (d * d)};
}

Domain domainOf(const shared::Light& light, dvec3 eye) {
    const dvec3 position(light.position), u(light.axisU), v(light.axisV), n(light.normal);
    const auto planar = [=](dvec3 point) {
        const dvec3 q = point - position, normal = glm::cross(u, v);
        return dvec2(glm::dot(q, glm::cross(v, normal)), glm::dot(q, glm::cross(normal, u))) / glm::dot(normal, normal);
    };
    const auto pointOf = [=](const Sample& s) { return eye + dvec3(s.wi) * double(s.distance); };
    switch (light.kind) {
    case shared::kLightRect:
        return {[=](double s, double t) {
                    return planarElement(light, eye, position + (s - 0.5) * u + (t - 0.5) * v,
                                         glm::length(glm::cross(u, v)));
                },
                [=](const Sample& s) { return planar(pointOf(s)) + 0.5; }};
    case shared::kLightTriangle:
        return {[=](double s, double t) {
                    const double r = std::sqrt(s);
                    return planarElement(light, eye, position + r * (1 - t) * u + r * t * v,
                                         glm::length(glm::cross(u, v)) / 2);
                },
                [=](const Sample& s) {
                    const dvec2 b = planar(pointOf(s));
                    return dvec2((b.x + b.y) * (b.x + b.y), b.y / (b.x + b.y));
                }};
    case shared::kLightDisk:
        return {[=](double s, double t) {
                    const double r = std::sqrt(s);
                    return planarElement(light, eye,
                                         position + r * std::cos(2 * pi * t) * u + r * std::sin(2 * pi * t) * v,
                                         pi * glm::length(glm::cross(u, v)));
                },
                [=](const Sample& s) {
                    const dvec2 p = planar(pointOf(s));
                    return dvec2(glm::dot(p, p), wrapped(std::atan2(p.y, p.x)) / (2 * pi));
                }};
    case shared::kLightSphere: {
        const dmat3 worldFromLocal(u, v, n * double(light.radius));
        const dvec3 local = glm::inverse(worldFromLocal) * (eye - position);
        const double d = glm::length(local), range = 1 - std::sqrt(1 - 1 / (d * d));
        const dmat3 frame = frameAround(-local / d);
        return {[=](double s, double t) {
                    const double c = 1 - s * range, sine = std::sqrt(1 - c * c), phi = 2 * pi * t;
                    const dvec3 w = frame * dvec3(sine * std::cos(phi), sine * std::sin(phi), c);
                    const double hit = d * c - std::sqrt(std::max(0.0, 1 - d * d * sine * sine));
                    const dvec3 to = worldFromLocal * w;
                    const double stretch = glm::length(to);
                    return Domain::Element{to / stretch, eye + hit * to,
                                           2 * pi * range * std::abs(glm::determinant(worldFromLocal)) /
                                               std::pow(stretch, 3)};
                },
                [=](const Sample& s) {
                    const dvec3 w = glm::normalize(glm::inverse(worldFromLocal) * dvec3(s.wi)) * frame;
                    return dvec2((1 - w.z) / range, wrapped(std::atan2(w.y, w.x)) / (2 * pi));
                }};
    }
    case shared::kLightCylinder: { // round ones only
        const double radius = light.radius, length = glm::length(u);
        const dvec3 axis = u / length, q = position - eye;
        const dvec3 across = q - axis * glm::dot(axis, q);
        const double r = glm::length(across), half = std::asin(radius / r), middle = glm::dot(axis, q);
        const dvec3 x = across / r, y = glm::cross(axis, x);
        return {[=](double s, double t) {
                    const double a = (2 * s - 1) * half, offset = r * std::sin(a);
                    const double d = r * std::cos(a) - std::sqrt(std::max(0.0, radius * radius - offset * offset));
                    const double along = middle + (t - 0.5) * length;
                    const dvec3 to = d * (std::cos(a) * x + std::sin(a) * y) + along * axis;
                    return Domain::Element{glm::normalize(to), eye + to,
                                           2 * half * length * d * d / std::pow(d * d + along * along, 1.5)};
                },
                [=](const Sample& s) {
                    const dvec3 w(s.wi);
                    return dvec2(0.5 + std::atan2(glm::dot(w, y), glm::dot(w, x)) / (2 * half),
                                 0.5 + (glm::dot(w, axis) * double(s.distance) - middle) / length);
                }};
    }
    case shared::kLightDistant: {
        const dmat3 frame = frameAround(-n);
        const double range = light.radius;
        return {[=](double s, double t) {
                    const double c = 1 - s * range, sine = std::sqrt(s * range * (2 - s * range)), phi = 2 * pi * t;
                    return Domain::Element{frame * dvec3(sine * std::cos(phi), sine * std::sin(phi), c), dvec3(0),
                                           2 * pi * range};
                },
                [=](const Sample& s) {
                    const dvec3 w = dvec3(s.wi) * frame;
                    return dvec2((w.x * w.x + w.y * w.y) / (1 + w.z) / range, wrapped(std::atan2(w.y, w.x)) / (2 * pi));
                }};
    }
    default: // dome: OpenEXR's latitude and longitude
        return {[=](double s, double t) {
                    const double longitude = (0.5 - s) * 2 * pi, latitude = (t - 0.5) * pi;
                    const dvec3 w = std::cos(latitude) * std::sin(longitude) * u + std::sin(latitude) * v +
                                    std::cos(latitude) * std::cos(longitude) * n;
                    return Domain::Element{w, dvec3(0), 2 * pi * pi * std::cos(latitude)};
                },
                [=](const Sample& s) {
                    const dvec3 w(s.wi);
                    return dvec2(0.5 - std::atan2(glm::dot(w, u), glm::dot(w, n)) / (2 * pi),
                                 0.5 + std::asin(std::clamp(glm::dot(w, v), -1.0, 1.0)) / pi);
                }};
    }
}

class LightSampling : public test::LightTest {
protected:
    static constexpr uint32_t kCount = 1 << 17;

    std::vector<Sample> sample(const shared::Light& light, dvec3 eye, uint32_t seed = 1) {
        const gpu::Buffer lights = bufferOf(std::vector{light}), samples = bufferFor<Sample>(kCount);
        dispatch("SAMPLE", {lights.address(), distributions(), samples.address(), 0, 0, glm::vec3(eye), kCount, seed});
        return read<Sample>(samples, kCount);
    }

    std::vector<float> evaluate(const shared::Light& light, dvec3 eye, const std::vector<Direction>& directions) {
        const gpu::Buffer lights = bufferOf(std::vector{light}), inputs = bufferOf(directions);
        const gpu::Buffer pdfs = bufferFor<float>(directions.size());
        dispatch("EVALUATE", {lights.address(), distributions(), 0, inputs.address(), pdfs.address(), glm::vec3(eye),
                              uint32_t(directions.size()), 0});
        return read<float>(pdfs, directions.size());
    }

    /// The density integrates to 1 over where the light is seen, and the samples follow it.
    void expectSamplesFollowDensity(const std::string& name, const shared::Light& light, dvec3 eye) {
        SCOPED_TRACE(name);
        constexpr int kBins = 12, kPoints = 30; // per axis; points per bin
        constexpr int kGrid = kBins * kPoints;
        const Domain domain = domainOf(light, dvec3(glm::vec3(eye)));
        std::vector<Direction> directions;
        std::vector<double> measures;
        for (int i = 0; i < kGrid * kGrid; ++i) {
            const Domain::Element e = domain.at((i % kGrid + 0.5) / kGrid, (i / kGrid + 0.5) / kGrid);
            directions.push_back({glm::vec3(e.wi), glm::vec3(e.point)});
            measures.push_back(e.measure);
        }
        const std::vector<float> pdfs = evaluate(light, eye, directions);
        std::vector<double> expected(kBins * kBins, 0.0), observed(kBins * kBins, 0.0);
        for (int i = 0; i < kGrid * kGrid; ++i) {
            expected[i / kGrid / kPoints * kBins + i % kGrid / kPoints] += pdfs[i] * measures[i] / (kGrid * kGrid);
        }
        EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0.0), 1.0, 2e-3);

        const std::vector<Sample> samples = sample(light, eye);
        for (const Sample& s : samples) {
            if (!(s.pdf > 0)) continue;
            const dvec2 st = glm::clamp(domain.inverse(s), 0.0, 1 - 1e-9);
            observed[int(st.y * kBins) * kBins + int(st.x * kBins)] += 1;
        }
        double statistic = 0, pooledExpected = 0, pooledObserved = 0;
        int cells = 0;
        const auto addCell = [&](double e, double o) {
            statistic += (o - e) * (o - e) / e;
            ++cells;
        };
        for (size_t i = 0; i < expected.size(); ++i) {
            const double e = expected[i] * kCount;
            if (e >= 20) {
                addCell(e, observed[i]);
            } else {
                pooledExpected += e;
                pooledObserved += observed[i];
            }
        }
        if (pooledExpected >= 20)
            addCell(pooledExpected, pooledObserved);
        else
            EXPECT_LE(pooledObserved, pooledExpected + 5 * std::sqrt(pooledExpected) + 5);
        EXPECT_GT(test::chiSquaredTail(statistic, cells - 1), kSignificance)
            << statistic << " over " << cells << " cells";

        // Both ends of MIS see the same density: sampling, and evaluation for a ray that arrives there.
        size_t different = 0;
        for (const Sample& s : samples) different += !(std::abs(s.pdfEvaluated / s.pdf - 1) < 1e-4f);
        EXPECT_LE(different, kCount / 1000);
    }

    /// Mean and standard error of radiance * cos / pdf.
    void expectIrradiance(const std::string& name, const shared::Light& light, dvec3 eye, dvec3 normal,
                          double expected) {
        SCOPED_TRACE(name);
        const dvec3 n = glm::normalize(normal);
        double sum = 0, squares = 0;
        for (const Sample& s : sample(light, eye, 2)) {
            const double value = s.pdf > 0 ? s.radiance.x * std::max(0.0, glm::dot(n, dvec3(s.wi))) / s.pdf : 0.0;
            sum += value;
            squares += value * value;
        }
        const double mean = sum / kCount, variance = std::max(0.0, squares / kCount - mean * mean);
        EXPECT_NEAR(mean, expected, 4.5 * std::sqrt(variance / kCount) + 1e-4 * expected);
    }

    // Of a run of all tests of this file: one in a thousand, shared by at most 60 chi-squared tests.
    static constexpr double kSignificance = 1e-3 / 60;

private:
    void dispatch(const char* define, const Push& push) {
        const gpu::Pipeline pipeline = compile(kKernel, {{define, "1"}});
        device().wait(device().submit([&](gpu::Commands& c) { c.dispatch(pipeline, push, push.count); }));
    }
};

TEST_F(LightSampling, RectFollowsItsDensity) {
    const Light rect{.kind = LightKind::Rect, .width = 1.3f, .height = 0.7f};
    const auto run = [&](const char* name, const dmat4& m, dvec3 eye) {
        expectSamplesFollowDensity(name, build(rect, m), eye);
    };
    run("below", place({0, 0, 0}), {0.2, -0.1, -1});
    run("close", place({0, 0, 0}), {0.3, 0.1, -0.05});
    run("beside, near its plane", place({0, 0, 0}), {1.5, 0.4, -0.1});
    run("far", place({3, 2, 1}, dvec3(1), 40, {1, 1, 0}), {150, -400, -900});
    run("long and thin", place({0, 0, 0}, {20, 0.02, 1}), {3, 0.1, -0.4});
    dmat4 shear(1);
    shear[1] = {0.8, 1, 0, 0};
    run("sheared", place({0, 0, 0}) * shear, {0.5, -0.2, -0.6});
    run("mirrored", place({0, 0, 0}, {-1, 1, 1}), {0.5, -0.2, -0.6});
    for (const double scale : {1e-5, 1e5}) {
        run("scaled", place({0, 0, 0}, dvec3(scale)), scale * dvec3(0.2, -0.1, -0.5));
        run("tiny in a scene", place(scale * dvec3(1, 2, 3), dvec3(scale * 1e-3)), scale * dvec3(0.2, -0.1, -0.5));
    }
}

TEST_F(LightSampling, TriangleFollowsItsDensity) {
    const auto run = [&](const char* name, dvec3 a, dvec3 b, dvec3 c, dvec3 eye) {
        expectSamplesFollowDensity(name, triangle(a, b, c), eye);
    };
    run("in front", {0, 0, 0}, {1, 0.1, 0}, {0.2, 0.8, 0.3}, {0.3, 0.2, 1});
    run("close", {0, 0, 0}, {1, 0.1, 0}, {0.2, 0.8, 0}, {0.4, 0.3, 0.05});
    run("beside", {0, 0, 0}, {1, 0.1, 0}, {0.2, 0.8, 0}, {1.4, -0.5, 0.1});
    run("sliver", {0, 0, 0}, {1, 0, 0}, {0.5, 0.004, 0}, {0.4, 0.3, 0.3});
    run("far", {0, 0, 0}, {1, 0.1, 0}, {0.2, 0.8, 0.3}, {200, 300, 1000});
    for (const double scale : {1e-5, 1e5}) {
        run("scaled", scale * dvec3(0, 0, 0), scale * dvec3(1, 0.1, 0), scale * dvec3(0.2, 0.8, 0.3),
            scale * dvec3(0.3, 0.2, 1));
    }
}

TEST_F(LightSampling, DiskFollowsItsDensity) {
    const Light disk{.kind = LightKind::Disk, .radius = 0.5f};
    const auto run = [&](const char* name, const dmat4& m, dvec3 eye) {
        expectSamplesFollowDensity(name, build(disk, m), eye);
    };
    run("below", place({0, 0, 0}), {0.2, -0.1, -1});
    run("on its axis", place({0, 0, 0}), {0, 0, -0.7});
    run("close", place({0, 0, 0}), {0.3, 0.1, -0.05});
    run("beside, near its plane", place({0, 0, 0}), {0.9, 0.4, -0.1});
    run("far", place({3, 2, 1}, dvec3(1), 40, {1, 1, 0}), {15, -40, -90});
    run("ellipse", place({0, 0, 0}, {3, 0.5, 2}), {1, 0.4, -0.6});
    for (const double scale : {1e-5, 1e5}) {
        run("scaled", place({0, 0, 0}, dvec3(scale)), scale * dvec3(0.2, -0.1, -0.5));
    }
}

TEST_F(LightSampling, SphereFollowsItsDensity) {
    const Light sphere{.kind = LightKind::Sphere, .radius = 0.5f};
    const auto run = [&](const char* name, const dmat4& m, dvec3 eye) {
        expectSamplesFollowDensity(name, build(sphere, m), eye);
    };
    run("near", place({0, 0, 0}), {0.2, -0.1, -1});
    run("almost touching", place({0, 0, 0}), {0, 0.3, -0.402});
    run("far", place({3, 2, 1}), {150, -400, -900});
    run("ellipsoid", place({0, 0, 0}, {2, 0.5, 1}, 30, {1, 2, 3}), {1.5, 0.7, -0.6});
    for (const double scale : {1e-5, 1e5}) {
        run("scaled", place({0, 0, 0}, dvec3(scale)), scale * dvec3(0.2, -0.1, -0.9));
        run("tiny in a scene", place(scale * dvec3(1, 2, 3), dvec3(scale * 1e-3)), scale * dvec3(0.2, -0.1, -0.5));
    }
}

TEST_F(LightSampling, CylinderFollowsItsDensity) {
    const Light cylinder{.kind = LightKind::Cylinder, .radius = 0.2f, .length = 1.5f};
    const auto run = [&](const char* name, const dmat4& m, dvec3 eye) {
        expectSamplesFollowDensity(name, build(cylinder, m), eye);
    };
    run("near", place({0, 0, 0}), {0.2, -0.1, -1});
    run("close", place({0, 0, 0}), {0.3, 0.1, -0.25});
    run("past its end", place({0, 0, 0}), {2, 0.3, -0.25});
    run("far", place({3, 2, 1}, dvec3(1), 40, {1, 1, 0}), {15, -40, -90});
    for (const double scale : {1e-5, 1e5}) {
        run("scaled", place({0, 0, 0}, dvec3(scale)), scale * dvec3(0.2, -0.1, -0.5));
    }
}

TEST_F(LightSampling, LightsAtInfinityFollowTheirDensity) {
    const dmat4 turn = place({0, 0, 0}, dvec3(1), 70, {1, 2, -1});
    for (const float angle : {0.53f, 20.0f, 180.0f, 300.0f}) {
        expectSamplesFollowDensity("distant", build({.kind = LightKind::Distant, .angle = angle}, turn), {1, 2, 3});
    }
    expectSamplesFollowDensity("dome", build({.kind = LightKind::Dome}, turn), {1, 2, 3});
}

TEST_F(LightSampling, TexturedLightsFollowTheirDensity) {
    // 12 x 6 texels line up with the bins, so that the quadrature sees a smooth density in each.
    setTexture(spottedTexture(12, 6), TextureDomain::LatLong);
    expectSamplesFollowDensity(
        "dome", build({.kind = LightKind::Dome}, place({0, 0, 0}, dvec3(1), 70, {1, 2, -1}), true), {1, 2, 3});
    setTexture(spottedTexture(12, 6), TextureDomain::Rect);
    const Light rect{.kind = LightKind::Rect, .width = 1.3f, .height = 0.7f};
    expectSamplesFollowDensity("rect", build(rect, place({0, 0, 0}), true), {0.2, -0.1, -0.5});
    expectSamplesFollowDensity("close rect", build(rect, place({0, 0, 0}), true), {0.3, 0.1, -0.1});
}

/// Irradiance at `eye` from a polygon of radiance 1 (Lambert's formula), all of it above the receiver's horizon.
double polygonIrradiance(const std::vector<dvec3>& corners, dvec3 eye, dvec3 normal) {
    double sum = 0;
    for (size_t i = 0; i < corners.size(); ++i) {
        const dvec3 a = glm::normalize(corners[i] - eye), b = glm::normalize(corners[(i + 1) % corners.size()] - eye);
        const dvec3 c = glm::cross(a, b);
        const double sine = glm::length(c);
        sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(c / sine, normal);
    }
    return std::abs(sum) / 2;
}

TEST_F(LightSampling, IrradianceEqualsClosedForms) {
    const Light rect{.kind = LightKind::Rect, .width = 1, .height = 1};
    const std::vector<dvec3> corners{{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
    for (const dvec3 eye : {dvec3(0.2, -0.1, -1), dvec3(0.4, 0.45, -0.01), dvec3(2, 3, -0.5), dvec3(30, 20, -100)}) {
        expectIrradiance("rect", build(rect, dmat4(1)), eye, {0, 0, 1}, polygonIrradiance(corners, eye, {0, 0, 1}));
    }
    // d^2 >> area: L A cos cos / d^2, up to what a float direction can tell.
    for (const double d : {1e4, 1e6, 1e8}) {
        expectIrradiance("far rect", build(rect, dmat4(1)), {0, 0, -d}, {0, 0, 1}, 1 / (d * d));
        expectIrradiance("far triangle", triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), {0, 0, d}, {0, 0, -1},
                         0.5 / (d * d));
        expectIrradiance("far disk", build({.kind = LightKind::Disk, .radius = 1}, dmat4(1)), {0, 0, -d}, {0, 0, 1},
                         pi / (d * d));
        expectIrradiance("far sphere", build({.kind = LightKind::Sphere, .radius = 1}, dmat4(1)), {0, d, 0}, {0, -1, 0},
                         pi / (d * d));
        expectIrradiance("far cylinder", build({.kind = LightKind::Cylinder, .radius = 1, .length = 3}, dmat4(1)),
                         {0, d, 0}, {0, -1, 0}, 6 / (d * d));
    }
    const Light sphere{.kind = LightKind::Sphere, .radius = 0.5f};
    for (const double d : {0.5001, 0.6, 1.0, 50.0}) {
        expectIrradiance("sphere", build(sphere, dmat4(1)), {0, 0, d}, {0, 0, -1}, pi * 0.25 / (d * d));
    }
    const Light disk{.kind = LightKind::Disk, .radius = 0.5f};
    for (const double d : {0.001, 0.3, 1.0, 50.0}) {
        expectIrradiance("disk", build(disk, dmat4(1)), {0, 0, -d}, {0, 0, 1}, pi * 0.25 / (0.25 + d * d));
    }
    // An infinite line of light, radius a at distance r: 2 a L / r * pi / 2 for a << r.
    expectIrradiance("line", build({.kind = LightKind::Cylinder, .radius = 0.001f, .length = 2000}, dmat4(1)),
                     {0, 0, 1}, {0, 0, -1}, pi * 0.001);
    expectIrradiance("sun", build({.kind = LightKind::Distant, .angle = 30}, dmat4(1)), {0, 0, 0}, {0, 0, 1},
                     pi * std::pow(std::sin(glm::radians(15.0)), 2));
    expectIrradiance("sharp sun", build({.kind = LightKind::Distant, .radiance = glm::vec3(3), .angle = 0}, dmat4(1)),
                     {0, 0, 0}, {0, 0, 1}, 3);
    expectIrradiance("narrow sun", build({.kind = LightKind::Distant, .angle = 1e-4f, .normalize = true}, dmat4(1)),
                     {0, 0, 0}, {0, 0, 1}, 1);
    expectIrradiance("dome", build({.kind = LightKind::Dome}, dmat4(1)), {0, 0, 0}, {0, 1, 0}, pi);
}

TEST_F(LightSampling, EllipsoidIrradianceEqualsAreaIntegral) {
    const dmat4 m = place({0, 0, 0}, {2, 0.5, 1}, 30, {1, 2, 3});
    const dvec3 eye(1.5, 1.1, -1.2), normal = glm::normalize(-eye);
    const dmat3 a = dmat3(m) * 0.5, cofactor = glm::transpose(glm::inverse(a)) * glm::determinant(a);
    double sum = 0;
    constexpr int kSteps = 1500;
    for (int i = 0; i < kSteps * kSteps; ++i) {
        const double z = (2 * (i / kSteps) + 1.0) / kSteps - 1, phi = 2 * pi * (i % kSteps) / kSteps;
        const dvec3 local(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
        const dvec3 to = a * local - eye;
        const double d = glm::length(to);
        sum += std::max(0.0, -glm::dot(cofactor * local, to)) * std::max(0.0, glm::dot(normal, to)) / std::pow(d, 4);
    }
    expectIrradiance("ellipsoid", build({.kind = LightKind::Sphere, .radius = 0.5f}, m), eye, normal,
                     sum * 4 * pi / (double(kSteps) * kSteps));
}

} // namespace
} // namespace trilume
