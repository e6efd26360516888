#pragma once

#include "render/renderer.h"

#include <glm/gtc/matrix_transform.hpp>

namespace trilume::test {

/// Of the test program, under validation.
inline Engine& engine() {
    static Engine instance{[] {
        EngineOptions options;
        options.device.validation = true;
        return options;
    }()};
    return instance;
}

/// Faces the side from which a, b, c, d go counter-clockwise.
inline Mesh quad(const char* name, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d) {
    Mesh mesh;
    mesh.name = name;
    mesh.positions = {a, b, c, d};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

inline Material lambert(glm::vec3 color, glm::vec3 emission = glm::vec3(0)) {
    Material m;
    m.baseColor = color;
    m.ior = 1;
    m.emission = emission;
    return m;
}

inline glm::dmat4 cameraAt(glm::dvec3 position, glm::dvec3 target) {
    return glm::inverse(glm::lookAt(position, target, glm::dvec3(0, 1, 0)));
}

/// For square pictures.
inline Entity addCamera(Scene& scene, glm::dvec3 position, glm::dvec3 target) {
    const Entity entity = scene.createEntity("/Camera", cameraAt(position, target));
    Camera camera;
    camera.verticalAperture = camera.horizontalAperture;
    camera.focalLength = camera.horizontalAperture;
    scene.world.add(entity, camera);
    return entity;
}

} // namespace trilume::test
