#pragma once

#include "scene/components.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <vector>

namespace trilume {

enum class TextureDomain {
    Rect,   ///< equal areas of the picture are equal areas of the light
    LatLong ///< rows are circles of latitude: weighted by their cosine; wraps around horizontally, clamps at the poles
};

/// Host side of shared::Distribution: marginal (height + 1), conditional (height x (width + 1)) and density
/// (height x width), over texture coordinates, row 0 at v = 0, the picture's bottom.
struct TextureDistribution {
    uint32_t width = 0, height = 0;
    std::vector<float> marginal, conditional, density;
    glm::vec3 mean{0}; ///< of the linear colour over the domain (LatLong: over the sphere)
};

/// Density proportional to the luminance of the bilinearly filtered texture's average over each cell, so it is positive
/// wherever that texture is; at most 1024 x 512 cells. `density` holds exactly what inversion of the float sums draws.
/// Values that are negative or not finite count as 0; a black texture gives the domain's uniform density.
TextureDistribution buildTextureDistribution(const Texture& texture, TextureDomain domain);

} // namespace trilume
