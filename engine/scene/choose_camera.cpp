#include "core/error.h"
#include "core/log.h"
#include "core/text.h"
#include "scene/scene.h"

#include <algorithm>

namespace trilume {
namespace {

constexpr std::string_view kFramingCamera = "/trilumeFramingCamera";

struct NamedCamera {
    Entity entity;
    std::string path;
};

std::vector<NamedCamera> camerasOf(const Scene& scene) {
    std::vector<NamedCamera> cameras;
    scene.world.each<Camera>([&](Entity entity, const Camera&) {
        const Name* name = scene.world.find<Name>(entity);
        cameras.push_back({entity, name ? name->path : ""});
    });
    return cameras;
}

std::string listOf(const std::vector<NamedCamera>& cameras) {
    std::vector<std::string> paths;
    paths.reserve(cameras.size());
    for (const NamedCamera& camera : cameras) paths.push_back(camera.path);
    std::sort(paths.begin(), paths.end());
    return commaList(paths);
}

bool isLastComponent(std::string_view path, std::string_view name) { return path.substr(path.rfind('/') + 1) == name; }

Entity cameraNamed(const Scene& scene, const std::vector<NamedCamera>& cameras, std::string_view name) {
    std::vector<NamedCamera> matches;
    for (const NamedCamera& camera : cameras) {
        if (camera.path == name) return camera.entity;
        if (isLastComponent(camera.path, name)) matches.push_back(camera);
    }
    if (matches.size() == 1) return matches.front().entity;
    if (matches.size() > 1)
        throw inputError("several cameras have this name", std::string(name), "give one's path: " + listOf(matches));
    throw inputError("unknown camera", std::string(name),
                     cameras.empty()
                         ? "there is no camera in " + scene.path + ": leave the option out to frame its bounds"
                         : "choose one of: " + listOf(cameras));
}

/// Far enough along +Z that the whole box stands inside the picture, with a margin of a tenth.
glm::dmat4 framing(const Bounds& bounds, const Camera& camera) {
    if (bounds.empty()) return glm::dmat4(1);
    const glm::dvec3 half = 0.5 * (bounds.max - bounds.min);
    const double distanceForWidth = half.x * 2 * camera.focalLength / camera.horizontalAperture;
    const double distanceForHeight = half.y * 2 * camera.focalLength / camera.verticalAperture;
    double distance = half.z + 1.1 * std::max(distanceForWidth, distanceForHeight);
    if (distance <= 0) distance = 1;
    glm::dmat4 worldFromCamera(1);
    worldFromCamera[3] = glm::dvec4(bounds.center() + glm::dvec3(0, 0, distance), 1);
    return worldFromCamera;
}

Entity createFramingCamera(Scene& scene, const std::vector<NamedCamera>& cameras) {
    scene.updateTransforms();
    const Camera camera;
    const Entity entity = scene.createEntity(std::string(kFramingCamera), framing(scene.bounds(), camera));
    scene.world.add(entity, camera);
    if (cameras.empty())
        log::info("no camera in {}: one was added that frames what there is", scene.path);
    else
        log::warning("several cameras in {} and none chosen: framing the bounds; choose one of: {}", scene.path,
                     listOf(cameras));
    return entity;
}

} // namespace

Entity chooseCamera(Scene& scene, std::string_view name) {
    const std::vector<NamedCamera> cameras = camerasOf(scene);
    if (!name.empty()) return cameraNamed(scene, cameras, name);
    for (const NamedCamera& camera : cameras)
        if (camera.path == kFramingCamera) return camera.entity;
    if (cameras.size() == 1) return cameras.front().entity;
    for (const NamedCamera& camera : cameras)
        if (camera.path == scene.renderSettings.camera) return camera.entity;
    return createFramingCamera(scene, cameras);
}

} // namespace trilume
