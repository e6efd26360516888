#pragma once

#include "gpu/device.h"
#include "rt/accel.h"
#include "shared/scene.h"

#include <glm/gtc/matrix_inverse.hpp>

#include <span>
#include <string>
#include <vector>

namespace trilume::test {

struct TraceRay {
    glm::vec3 origin;
    float tMin = 0.0f;
    glm::vec3 direction;
    float tMax = std::numeric_limits<float>::infinity();
};

struct TraceHit {
    float t;
    uint32_t instance; ///< shared::kNone: nothing; any-hit rays: 0 for something
    uint32_t primitive;
    glm::vec2 uv;
};

/// Traces rays from a buffer and writes their hits.
inline constexpr const char* kTraceKernel = R"(#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/scene.h"
struct TraceRay { vec3 origin; float tMin; vec3 direction; float tMax; };
struct TraceHit { float t; uint instance; uint primitive; vec2 uv; };
TL_DECLARE_REF(TraceRay)
TL_DECLARE_REF(TraceHit)
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SceneTableRef scene; TraceRayRef rays; TraceHitRef hits; uint count, mask; };
#define TL_SCENE scene.v[0]
#include "scene/trace.glsl"
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    const TraceRay ray = rays.v[i];
    Hit hit;
#ifdef ANY_HIT
    hit = Hit(ray.tMax, kNone, 0, vec2(0));
    if (traceAny(ray.origin, ray.direction, ray.tMin, ray.tMax, mask)) hit.instance = 0;
#else
    traceClosest(ray.origin, ray.direction, ray.tMin, ray.tMax, mask, hit);
#endif
    hits.v[i] = TraceHit(hit.t, hit.instance, hit.primitive, hit.uv);
}
)";

/// A scene as the tracer needs it, without the rest of the engine.
class TraceScene {
public:
    TraceScene(gpu::Device& device, gpu::Tracer tracer) : device_(device), accel(device, tracer) {
        std::vector<std::pair<std::string, std::string>> defines;
        if (tracer == gpu::Tracer::Query) defines.emplace_back("TL_TRACER_QUERY", "1");
        closest_ = device.createPipeline({.path = "trace closest", .defines = defines, .text = kTraceKernel});
        defines.emplace_back("ANY_HIT", "1");
        any_ = device.createPipeline({.path = "trace any", .defines = defines, .text = kTraceKernel});
    }

    /// Brings the device's tables up to date with `instances` and the meshes that they use.
    void commit() {
        accel.setInstances(instances);
        std::vector<shared::Mesh> meshes;
        std::vector<shared::Instance> table;
        for (const rt::InstanceInput& input : instances) {
            shared::Instance& row = table.emplace_back();
            row.worldFromLocal = input.worldFromLocal;
            row.localFromWorld = glm::mat4x3(glm::affineInverse(glm::dmat4(glm::dmat4x3(input.worldFromLocal))));
            row.shape = input.shape;
            row.mask = input.mask;
            row.mesh = shared::kNone;
            if (input.mesh) {
                const rt::MeshAccelAddresses addresses = accel.addresses(input.mesh);
                row.mesh = static_cast<uint32_t>(meshes.size());
                shared::Mesh& mesh = meshes.emplace_back();
                mesh.nodes = addresses.nodes;
                mesh.leafTriangles = addresses.leafTriangles;
            }
        }
        meshes_ = device_.createBufferFrom(std::span<const shared::Mesh>(meshes), "meshes");
        table_ = device_.createBufferFrom(std::span<const shared::Instance>(table), "instances");
        shared::SceneTable scene{};
        scene.topNodes = accel.topNodes();
        scene.topInstances = accel.topInstances();
        scene.instances = table_.address();
        scene.meshes = meshes_.address();
        scene.instanceCount = static_cast<uint32_t>(table.size());
        scene_ = device_.createBufferFrom(std::span<const shared::SceneTable>(&scene, 1), "scene");
    }

    VkDeviceAddress table() const { return scene_.address(); }

    /// Rays on the device, and room for their hits.
    struct Batch {
        gpu::Buffer rays, hits;
        uint32_t count = 0;
    };
    Batch upload(std::span<const TraceRay> rays) {
        return {device_.createBufferFrom(rays, "rays"),
                device_.createBuffer(rays.size() * sizeof(TraceHit), gpu::Memory::Device, "hits"),
                static_cast<uint32_t>(rays.size())};
    }
    /// Milliseconds on the device.
    double trace(const Batch& batch, bool anyHit = false, uint32_t mask = shared::kMaskAll) {
        struct Push {
            VkDeviceAddress scene, rays, hits;
            uint32_t count, mask;
        } push{scene_.address(), batch.rays.address(), batch.hits.address(), batch.count, mask};
        const gpu::Submission submission = device_.submit([&](gpu::Commands& commands) {
            commands.timestamp(0);
            commands.dispatch(anyHit ? any_ : closest_, push, batch.count);
            commands.timestamp(1);
        });
        device_.wait(submission);
        return device_.timestamps(submission)[1];
    }
    std::vector<TraceHit> trace(std::span<const TraceRay> rays, bool anyHit = false, uint32_t mask = shared::kMaskAll) {
        const Batch batch = upload(rays);
        trace(batch, anyHit, mask);
        return read(batch);
    }
    std::vector<TraceHit> read(const Batch& batch) {
        std::vector<TraceHit> hits(batch.count);
        device_.download(batch.hits, 0, std::as_writable_bytes(std::span(hits)));
        return hits;
    }

private:
    gpu::Device& device_;
    gpu::Pipeline closest_, any_;
    gpu::Buffer meshes_, table_, scene_;

public:
    rt::SceneAccel accel;
    std::vector<rt::InstanceInput> instances;
};

} // namespace trilume::test
