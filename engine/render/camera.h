#pragma once

#include "scene/scene.h"
#include "shared/frame.h"

namespace trilume {

/// The device's camera for a scene camera at `worldFromLocal` (looking along -Z, +Y up), in render space
/// (world - origin). The horizontal aperture holds; the vertical one follows the picture's ratio, as pixels are square.
shared::Camera makeCamera(const Camera& camera, const glm::dmat4& worldFromLocal, glm::dvec3 origin, uint32_t width,
                          uint32_t height);

} // namespace trilume
