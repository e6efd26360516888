#include "rt/accel.h"

#include "core/clock.h"
#include "core/error.h"
#include "rt/accel_backend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace trilume::rt {
namespace {

/// A box around the shape under `m`, in double precision. Shapes are unit shapes: shared/scene.h.
std::array<glm::dvec3, 2> placedBox(uint32_t shape, const Box& mesh, const glm::dmat4x3& m) {
    glm::dvec3 center = m[3], reach(0);
    if (shape == shared::kShapeMesh) {
        const glm::dvec3 low(mesh.min), high(mesh.max);
        center = m * glm::dvec4((low + high) * 0.5, 1.0);
        const glm::dvec3 half = (high - low) * 0.5;
        reach = glm::abs(m[0]) * half.x + glm::abs(m[1]) * half.y + glm::abs(m[2]) * half.z;
    } else if (shape == shared::kShapeSphere) {
        reach = glm::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    } else if (shape == shared::kShapeRect) {
        reach = (glm::abs(m[0]) + glm::abs(m[1])) * 0.5;
    } else if (shape == shared::kShapeDisk) {
        reach = glm::sqrt(m[0] * m[0] + m[1] * m[1]);
    } else {
        reach = glm::abs(m[0]) * 0.5 + glm::sqrt(m[1] * m[1] + m[2] * m[2]);
    }
    return {center - reach, center + reach};
}

/// Empty when the instance can't be hit.
Box worldBounds(const InstanceInput& instance, const Box& mesh) {
    const glm::dmat4x3 m(instance.worldFromLocal);
    const double determinant = glm::dot(m[0], glm::cross(m[1], m[2]));
    if ((instance.shape == shared::kShapeMesh && mesh.empty()) || determinant == 0.0 || !std::isfinite(determinant)) {
        return {};
    }
    auto [low, high] = placedBox(instance.shape, mesh, m);
    // Rays are moved into local space in single precision: allow for what rounding moves them there.
    const glm::dvec3 slack = glm::max(glm::abs(low), glm::abs(high)) * 1e-6;
    const Box box{glm::vec3(low - slack), glm::vec3(high + slack)};
    const glm::vec3 greatest = glm::max(glm::abs(box.min), glm::abs(box.max));
    return greatest.x <= 1e18f && greatest.y <= 1e18f && greatest.z <= 1e18f ? box : Box{};
}

gpu::Tracer choose(const gpu::Device& device, gpu::Tracer tracer) {
    if (tracer == gpu::Tracer::Query && !device.rayQuery()) {
        throw inputError("device has no ray queries (VK_KHR_ray_query)", device.info().name,
                         "use --tracer compute or another device");
    }
    if (tracer != gpu::Tracer::Auto) return tracer;
    return device.rayQuery() && !device.isCpu() ? gpu::Tracer::Query : gpu::Tracer::Compute;
}

} // namespace

struct SceneAccel::Mesh {
    std::vector<glm::uvec3> triangles;
    std::string name;
    Box bounds;
    MeshAccelReport report;
    std::vector<bool> usable; ///< per triangle; kept for deforming meshes
    bool deforming = false;
    bool alive = false;
};

struct SceneAccel::State {
    std::unique_ptr<AccelBackend> backend;
    std::vector<Mesh> meshes;
    std::vector<uint32_t> freeSlots;
    std::vector<InstanceInput> instances;
    std::vector<Box> bounds; ///< of the instances, in the world
    bool topOutdated = true;
    AccelStats stats;

    Mesh& at(MeshAccelId id) {
        if (id.slot >= meshes.size() || !meshes[id.slot].alive) {
            throw runError("no such mesh", "acceleration structure", "the handle was removed before, or never given");
        }
        return meshes[id.slot];
    }

    Box boundsOf(const InstanceInput& instance) {
        Box mesh;
        if (instance.shape == shared::kShapeMesh && instance.mesh) mesh = at(instance.mesh).bounds;
        return worldBounds(instance, mesh);
    }

    /// Builds or refits the mesh in `slot`.
    void place(uint32_t slot, std::span<const glm::vec3> positions, bool mayRefit, const Bvh* built = nullptr) {
        const Stopwatch watch;
        Mesh& mesh = meshes[slot];
        const TriangleInput input = triangleBoxes(positions, mesh.triangles, TaskPool::shared());
        std::vector<bool> usable;
        if (mesh.deforming) {
            usable.reserve(input.boxes.size());
            for (const Box& box : input.boxes) usable.push_back(!box.empty());
        }
        // Refitting keeps the set of triangles.
        mayRefit = mayRefit && mesh.deforming && usable == mesh.usable;
        const MeshInput from{positions, mesh.triangles, input, mesh.deforming, mesh.name, built};
        if (mayRefit && backend->refit(slot, from)) {
            ++stats.blasRefit;
        } else {
            stats.blasBuilt += backend->build(slot, from) ? 1 : 0;
        }
        mesh.usable = std::move(usable);
        mesh.report = {input.invalid, input.degenerate};
        mesh.bounds = {};
        for (const Box& box : input.boxes) mesh.bounds.grow(box);
        topOutdated = true;
        stats.buildMs += watch.ms();
    }
};

SceneAccel::SceneAccel(gpu::Device& device, gpu::Tracer tracer)
    : tracer_(choose(device, tracer)), state_(std::make_unique<State>()) {
    state_->backend = tracer_ == gpu::Tracer::Query ? createQueryBackend(device) : createComputeBackend(device);
}

SceneAccel::~SceneAccel() = default;

MeshAccelId SceneAccel::addMesh(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                                bool deforming, std::string_view name, const Bvh* built) {
    uint32_t slot = static_cast<uint32_t>(state_->meshes.size());
    if (state_->freeSlots.empty()) {
        state_->meshes.emplace_back();
    } else {
        slot = state_->freeSlots.back();
        state_->freeSlots.pop_back();
    }
    Mesh& mesh = state_->meshes[slot];
    mesh.triangles.assign(triangles.begin(), triangles.end());
    mesh.name = name;
    mesh.deforming = deforming;
    mesh.alive = true;
    state_->place(slot, positions, false, built);
    return {slot};
}

void SceneAccel::updateMesh(MeshAccelId id, std::span<const glm::vec3> positions) {
    state_->at(id);
    state_->place(id.slot, positions, true);
}

void SceneAccel::removeMesh(MeshAccelId id) {
    state_->at(id) = {};
    state_->backend->remove(id.slot);
    state_->freeSlots.push_back(id.slot);
    state_->topOutdated = true;
}

MeshAccelAddresses SceneAccel::addresses(MeshAccelId id) const {
    state_->at(id);
    return state_->backend->addresses(id.slot);
}

MeshAccelReport SceneAccel::report(MeshAccelId id) const { return state_->at(id).report; }

void SceneAccel::setInstances(std::span<const InstanceInput> instances) {
    State& state = *state_;
    if (!state.topOutdated && std::ranges::equal(instances, state.instances)) return;
    const Stopwatch watch;
    if (state.topOutdated) state.instances.clear(); // meshes changed, and with them any bounds
    state.bounds.resize(instances.size());
    std::vector<PlacedInstance> placed;
    placed.reserve(instances.size());
    for (uint32_t i = 0; i < instances.size(); ++i) {
        const InstanceInput& instance = instances[i];
        if (i >= state.instances.size() || instance != state.instances[i]) state.bounds[i] = state.boundsOf(instance);
        if (!state.bounds[i].empty() && instance.mask != 0) placed.push_back({i, &instance, state.bounds[i]});
    }
    state.topOutdated = true; // until it is built
    state.instances.assign(instances.begin(), instances.end());
    state.backend->buildTop(placed);
    state.topOutdated = false;
    ++state.stats.tlasBuilt;
    state.stats.buildMs += watch.ms();
}

void SceneAccel::moveInstances(std::span<const InstanceInput> instances, std::span<const uint32_t> moved) {
    State& state = *state_;
    const Stopwatch watch;
    std::vector<PlacedInstance> placed;
    bool sameSet = !state.topOutdated;
    for (const uint32_t i : moved) {
        if (!sameSet) break;
        if (instances[i] == state.instances[i]) continue;
        if (instances[i].mask == 0) { // in no structure; its bounds are found when its mask changes
            state.instances[i] = instances[i];
            continue;
        }
        placed.push_back({i, &instances[i], state.boundsOf(instances[i])});
        sameSet = !placed.back().bounds.empty() && !state.bounds[i].empty();
    }
    if (!sameSet) return setInstances(instances);
    if (placed.empty()) return;
    state.topOutdated = true; // until it is refit
    const bool refit = state.backend->moveTop(placed);
    state.topOutdated = false;
    if (!refit) return setInstances(instances);
    for (const PlacedInstance& instance : placed) {
        state.instances[instance.index] = *instance.input;
        state.bounds[instance.index] = instance.bounds;
    }
    ++state.stats.tlasBuilt;
    state.stats.buildMs += watch.ms();
}

void SceneAccel::use(bool previous) const { state_->backend->use(previous); }
VkDeviceAddress SceneAccel::topNodes() const { return state_->backend->topNodes(); }
VkDeviceAddress SceneAccel::topInstances() const { return state_->backend->topInstances(); }

void SceneAccel::beginUpdate() {
    state_->stats = {};
    state_->backend->beginUpdate();
}
const AccelStats& SceneAccel::stats() const { return state_->stats; }

} // namespace trilume::rt
