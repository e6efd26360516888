// Rays per second of both tracers and of Embree's single-ray functions with the same threads, rays and triangles.
//   bench_tracer [--smoke] [--json] [--rays N] [--repeats N] [--scene N] [--no-query]
// Each figure is the median over repeats that are interleaved between the tracers, so that a busy machine slows all
// alike.
#include "bench/tracer/harness.h"

#include "core/clock.h"
#include "core/error.h"
#include "rt/bvh.h"

#include <embree3/rtcore.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <thread>

namespace trilume::test {
namespace {

struct Options {
    bool smoke = false, json = false, query = true;
    uint32_t rays = 1 << 19, repeats = 5;
    int scene = -1;
};

struct Geometry {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
};

/// A closed room of 10 triangles (no wall behind the camera at z = -1), with `balls` dented balls of 2 * n * n
/// triangles.
Geometry room(int balls, int n) {
    Geometry g;
    const glm::vec3 corners[8] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                  {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    g.positions.assign(corners, corners + 8);
    g.triangles = {{0, 1, 5}, {0, 5, 4}, {3, 7, 6}, {3, 6, 2}, {0, 4, 7},
                   {0, 7, 3}, {1, 2, 6}, {1, 6, 5}, {4, 5, 6}, {4, 6, 7}};
    std::mt19937 engine(42);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    for (int ball = 0; ball < balls; ++ball) {
        const glm::vec3 center = 0.75f * glm::vec3(uniform(engine), uniform(engine), uniform(engine));
        const float radius = 0.16f + 0.08f * uniform(engine), phase = 3.0f * uniform(engine);
        const auto first = static_cast<uint32_t>(g.positions.size());
        for (int i = 0; i <= n; ++i) {
            for (int j = 0; j <= n; ++j) {
                const float theta = float(M_PI) * float(i) / float(n),
                            phi = 2.0f * float(M_PI) * float(j % n) / float(n);
                const float r = radius * (1.0f + 0.15f * std::sin(7 * phi + phase) * std::sin(5 * theta));
                g.positions.push_back(center + r * glm::vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                             std::sin(theta) * std::sin(phi)));
            }
        }
        for (uint32_t i = 0; i < uint32_t(n); ++i) {
            for (uint32_t j = 0; j < uint32_t(n); ++j) {
                const uint32_t a = first + i * uint32_t(n + 1) + j, b = a + uint32_t(n) + 1;
                if (i > 0) g.triangles.emplace_back(a, b, a + 1);
                if (i + 1 < uint32_t(n)) g.triangles.emplace_back(a + 1, b, b + 1);
            }
        }
    }
    return g;
}

struct RaySet {
    std::string name;
    std::vector<TraceRay> rays;
    bool anyHit = false;
};

std::vector<RaySet> raySets(uint32_t count) {
    std::vector<RaySet> sets(3);
    std::mt19937 engine(7);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    auto direction = [&] {
        for (;;) {
            const glm::vec3 v(uniform(engine), uniform(engine), uniform(engine));
            if (const float l = glm::length(v); l > 0.01f && l <= 1.0f) return v / l;
        }
    };
    sets[0].name = "coherent";
    const auto side = static_cast<uint32_t>(std::sqrt(double(count)));
    for (uint32_t i = 0; i < count; ++i) {
        const float x = 2.0f * (float(i % side) + 0.5f) / float(side) - 1.0f;
        const float y = 2.0f * (float(i / side) + 0.5f) / float(side) - 1.0f;
        sets[0].rays.push_back({glm::vec3(0, 0, -3), 0.0f, glm::normalize(glm::vec3(x, y, 2.5f))});
    }
    sets[1].name = "incoherent";
    for (uint32_t i = 0; i < count; ++i) {
        sets[1].rays.push_back(
            {0.95f * glm::vec3(uniform(engine), uniform(engine), uniform(engine)), 0.0f, direction()});
    }
    sets[2].name = "shadow";
    sets[2].anyHit = true;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3 from = 0.95f * glm::vec3(uniform(engine), uniform(engine), uniform(engine));
        const glm::vec3 to(0.3f * uniform(engine), 0.95f, 0.3f * uniform(engine));
        sets[2].rays.push_back({from, 0.0f, to - from, 1.0f});
    }
    return sets;
}

class Embree {
public:
    explicit Embree(const Geometry& g, unsigned threads)
        : threads_(threads), device_(rtcNewDevice(fmt::format("threads={}", threads).c_str())) {
        scene_ = rtcNewScene(device_);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                 sizeof(glm::vec3), g.positions.size());
        std::memcpy(vertices, g.positions.data(), g.positions.size() * sizeof(glm::vec3));
        auto* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                sizeof(glm::uvec3), g.triangles.size());
        std::memcpy(indices, g.triangles.data(), g.triangles.size() * sizeof(glm::uvec3));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        const Stopwatch watch;
        rtcCommitScene(scene_);
        buildMs = watch.ms();
    }
    ~Embree() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    Embree(const Embree&) = delete;
    Embree& operator=(const Embree&) = delete;

    double trace(const RaySet& set, std::vector<TraceHit>& hits) {
        hits.resize(set.rays.size());
        const Stopwatch watch;
        std::vector<std::thread> workers;
        std::atomic<size_t> next{0};
        for (unsigned t = 0; t < threads_; ++t) {
            workers.emplace_back([&] {
                constexpr size_t kChunk = 1024;
                for (size_t begin; (begin = next.fetch_add(kChunk)) < hits.size();) {
                    const size_t end = std::min(begin + kChunk, hits.size());
                    for (size_t i = begin; i < end; ++i) hits[i] = traceOne(set.rays[i], set.anyHit);
                }
            });
        }
        for (std::thread& worker : workers) worker.join();
        return watch.ms();
    }

    double buildMs = 0.0;

private:
    TraceHit traceOne(const TraceRay& from, bool anyHit) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit ray{};
        ray.ray.org_x = from.origin.x;
        ray.ray.org_y = from.origin.y;
        ray.ray.org_z = from.origin.z;
        ray.ray.dir_x = from.direction.x;
        ray.ray.dir_y = from.direction.y;
        ray.ray.dir_z = from.direction.z;
        ray.ray.tnear = from.tMin;
        ray.ray.tfar = from.tMax;
        ray.ray.mask = ~0u;
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        if (anyHit) {
            rtcOccluded1(scene_, &context, &ray.ray);
            return {from.tMax, ray.ray.tfar < 0.0f ? 0u : shared::kNone, 0, {}};
        }
        rtcIntersect1(scene_, &context, &ray);
        const bool hit = ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        return {ray.ray.tfar, hit ? 0u : shared::kNone, hit ? ray.hit.primID : 0, {ray.hit.u, ray.hit.v}};
    }

    unsigned threads_;
    RTCDevice device_;
    RTCScene scene_;
};

double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

/// Share of rays on which both agree: hit or miss, and t to 1e-4.
double agreement(std::span<const TraceHit> a, std::span<const TraceHit> b) {
    size_t same = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const bool hitA = a[i].instance != shared::kNone, hitB = b[i].instance != shared::kNone;
        same += hitA == hitB && (!hitA || std::abs(a[i].t - b[i].t) <= 1e-4f * std::max(1.0f, std::abs(b[i].t)));
    }
    return double(same) / double(a.size());
}

void print(bool json, bool& first, std::string_view scene, size_t triangles, std::string_view rays,
           const std::map<std::string, double>& rates) {
    auto rate = [&](const char* name) { return rates.contains(name) ? rates.at(name) : std::nan(""); };
    if (json) {
        fmt::print("{}\n  {{\"scene\": \"{}\", \"triangles\": {}, \"rays\": \"{}\"", first ? "" : ",", scene, triangles,
                   rays);
        for (const auto& [name, value] : rates) fmt::print(", \"{}\": {:.4g}", name, value);
        fmt::print("}}");
        first = false;
    } else {
        fmt::print("{:>9} {:>11} {:>10.3f} {:>10.3f} {:>10.3f} {:>15.3f} {:>14.2f}\n", triangles, rays, rate("compute"),
                   rate("query"), rate("embree"), rate("compute") / rate("embree"), rate("compute") / rate("query"));
    }
    std::fflush(stdout);
}

int run(const Options& options) {
    gpu::Device device({.device = "auto", .validation = options.smoke});
    const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    const bool query = options.query && device.rayQuery();
    struct SceneSize {
        const char* name;
        int balls, n;
    };
    std::vector<SceneSize> sizes{{"10", 0, 0}, {"7k", 14, 16}, {"180k", 20, 68}, {"1M", 20, 159}};
    if (options.smoke) sizes.resize(2);
    if (options.scene >= 0) sizes = {sizes.at(static_cast<size_t>(options.scene))};
    const std::vector<RaySet> sets = raySets(options.smoke ? 4096 : options.rays);
    const uint32_t repeats = options.smoke ? 1 : options.repeats;
    bool agreed = true, first = true;

    if (options.json) {
        fmt::print("{{\"device\": \"{}\", \"threads\": {}, \"unit\": \"Mrays/s\", \"results\": [", device.info().name,
                   threads);
    } else {
        fmt::print("{}, {} threads; million rays per second, median of {} interleaved repeats\n", device.info().name,
                   threads, repeats);
        fmt::print("{:>9} {:>11} {:>10} {:>10} {:>10} {:>15} {:>14}\n", "triangles", "rays", "compute", "query",
                   "embree", "compute/embree", "compute/query");
    }
    for (const SceneSize& size : sizes) {
        const Geometry geometry = room(size.balls, size.n);
        Embree embree(geometry, threads);
        const Stopwatch watch;
        const rt::TriangleInput boxes = rt::triangleBoxes(geometry.positions, geometry.triangles, TaskPool::shared());
        const rt::Bvh bvh = rt::buildBvh(boxes.boxes, {}, TaskPool::shared());
        const double buildMs = watch.ms();

        std::map<std::string, std::unique_ptr<TraceScene>> tracers;
        tracers["compute"] = std::make_unique<TraceScene>(device, gpu::Tracer::Compute);
        if (query) tracers["query"] = std::make_unique<TraceScene>(device, gpu::Tracer::Query);
        for (auto& [name, scene] : tracers) {
            const auto mesh = scene->accel.addMesh(geometry.positions, geometry.triangles, false, "bench");
            scene->instances = {{shared::kShapeMesh, mesh}};
            scene->commit();
        }
        device.waitIdle();
        for (const RaySet& set : sets) {
            std::map<std::string, TraceScene::Batch> batches;
            for (auto& [name, scene] : tracers) batches[name] = scene->upload(set.rays);
            std::map<std::string, std::vector<double>> times;
            std::vector<TraceHit> expected;
            for (uint32_t repeat = 0; repeat <= repeats; ++repeat) {
                for (auto& [name, scene] : tracers) {
                    const double ms = scene->trace(batches[name], set.anyHit);
                    if (repeat > 0) times[name].push_back(ms);
                }
                const double ms = embree.trace(set, expected);
                if (repeat > 0) times["embree"].push_back(ms);
            }
            std::map<std::string, double> rates;
            for (const auto& [name, ms] : times) rates[name] = double(set.rays.size()) / (median(ms) * 1e3);
            print(options.json, first, size.name, geometry.triangles.size(), set.name, rates);
            for (auto& [name, scene] : tracers) {
                const double share = agreement(scene->read(batches[name]), expected);
                // Edges of triangles decide differently in Embree, whose test is not watertight; more is a fault.
                if (share < 0.9995) {
                    fmt::print(stderr, "{} agrees with Embree on {:.3f}% of {} rays only\n", name, 100 * share,
                               set.name);
                    agreed = false;
                }
            }
        }
        if (options.json) {
            fmt::print(",\n  {{\"scene\": \"{}\", \"triangles\": {}, \"buildMs\": {:.4g}, \"embreeBuildMs\": {:.4g}, "
                       "\"cost\": "
                       "{:.4g}, \"depth\": {}}}",
                       size.name, geometry.triangles.size(), buildMs, embree.buildMs, bvh.cost, bvh.depth);
        } else {
            fmt::print("{:>9} {:>11} {:.1f} ms, embree {:.1f} ms; expected cost {:.1f}, depth {}\n",
                       geometry.triangles.size(), "build", buildMs, embree.buildMs, bvh.cost, bvh.depth);
        }
    }
    if (options.json) fmt::print("\n]}}\n");
    return agreed && device.validationMessages() == 0 ? 0 : 1;
}

} // namespace
} // namespace trilume::test

int main(int argc, char** argv) {
    trilume::test::Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        const bool more = i + 1 < argc;
        if (argument == "--smoke")
            options.smoke = true;
        else if (argument == "--json")
            options.json = true;
        else if (argument == "--no-query")
            options.query = false;
        else if (argument == "--rays" && more)
            options.rays = static_cast<uint32_t>(std::atoi(argv[++i]));
        else if (argument == "--repeats" && more)
            options.repeats = static_cast<uint32_t>(std::atoi(argv[++i]));
        else if (argument == "--scene" && more)
            options.scene = std::atoi(argv[++i]);
        else {
            fmt::print(stderr,
                       "usage: bench_tracer [--smoke] [--json] [--no-query] [--rays N] [--repeats N] [--scene 0..3]\n");
            return 2;
        }
    }
    try {
        return trilume::test::run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "bench_tracer: {}\n", error.what());
        return 1;
    }
}
