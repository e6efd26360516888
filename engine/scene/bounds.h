#pragma once

#include "ecs/world.h"

#include <glm/glm.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace trilume {

class Scene;

struct Bounds {
    glm::dvec3 min{std::numeric_limits<double>::infinity()};
    glm::dvec3 max{-std::numeric_limits<double>::infinity()};
    bool empty() const { return !(min.x <= max.x); }
    void grow(glm::dvec3 p) {
        min = glm::min(min, p);
        max = glm::max(max, p);
    }
    void grow(const Bounds& b) {
        min = glm::min(min, b.min);
        max = glm::max(max, b.max);
    }
    glm::dvec3 center() const { return 0.5 * (min + max); }
    double radius() const { return empty() ? 0 : 0.5 * glm::length(max - min); }
};

/// What Scene::bounds() tells, kept: of a scene in which few things move only these are measured.
class SceneBounds {
public:
    const Bounds& update(const Scene& scene);

private:
    struct MeshBounds {
        uint64_t pointsRevision = 0;
        Bounds local;
    };
    bool updateMeshes(const Scene& scene);
    void measureAll(const Scene& scene);
    void measureChanged(const Scene& scene, Tick since);
    Bounds measured(const Scene& scene, Entity entity) const;

    std::vector<MeshBounds> meshes_;
    std::vector<Bounds> boxes_; ///< by the index of the entity; in the world
    Bounds all_;
    std::optional<Tick> seen_;
    std::array<uint64_t, 5> turnovers_{}; ///< of the components that it goes by
};

} // namespace trilume
