#include "render/camera.h"

#include <algorithm>

namespace trilume {

shared::Camera makeCamera(const Camera& camera, const glm::dmat4& worldFromLocal, glm::dvec3 origin, uint32_t width,
                          uint32_t height) {
    // Scale in the camera's transform has no meaning for rays: orthonormal axes.
    const glm::dvec3 forward = -glm::normalize(glm::dvec3(worldFromLocal[2]));
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(worldFromLocal[1])));
    const glm::dvec3 up = glm::cross(right, forward);

    const double filmWidth = camera.horizontalAperture / camera.focalLength; // at distance 1
    const double filmHeight = filmWidth * height / width;
    const double centerX = camera.horizontalOffset / camera.focalLength;
    const double centerY = camera.verticalOffset / camera.focalLength;

    shared::Camera out{};
    out.position = glm::vec3(glm::dvec3(worldFromLocal[3]) - origin);
    out.filmCorner = glm::vec3(forward + (centerX - 0.5 * filmWidth) * right + (centerY + 0.5 * filmHeight) * up);
    out.filmU = glm::vec3(filmWidth * right);
    out.filmV = glm::vec3(-filmHeight * up);
    out.filmArea = static_cast<float>(filmWidth * filmHeight);
    out.right = glm::vec3(right);
    out.up = glm::vec3(up);
    out.forward = glm::vec3(forward);
    out.nearClip = camera.nearClip;
    out.farClip = std::min(camera.farClip, 1e30f);
    if (camera.fStop > 0 && camera.focusDistance > 0) {
        out.lensRadius = camera.focalLength * 1e-3f / (2 * camera.fStop);
        out.focusDistance = camera.focusDistance;
    }
    out.pixelAngle = static_cast<float>(filmWidth / width);
    return out;
}

} // namespace trilume
