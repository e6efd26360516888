#pragma once

#include "scene/components.h"
#include "shared/scene.h"

#include <glm/glm.hpp>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace trilume {

struct LightInput {
    const Light* component = nullptr;
    glm::dmat4 worldFromLocal{1};
    uint32_t instance = shared::kNone;     ///< whose exact shape it is; kNone: distant, dome
    uint32_t id = 0;                       ///< stable from frame to frame
    uint32_t image = shared::kNone;        ///< as shared::Light::image
    uint32_t distribution = shared::kNone; ///< index of the texture's distribution
    glm::vec3 textureMean{1};              ///< TextureDistribution::mean
};

struct EmissiveMeshInput {
    const Mesh* mesh = nullptr;
    glm::dmat4 worldFromLocal{1};
    uint32_t instance = shared::kNone;
    std::function<glm::vec3(uint32_t triangle)> radiance; ///< W/(m^2 sr); a mean where it varies; 0: none
    std::function<bool(uint32_t triangle)> varies; ///< whether a texture or a cut-out makes it vary; empty: never
    uint32_t firstId = 0;                          ///< triangle i has id firstId + i
};

/// Host side of SceneTable::lights, lightAlias and lightOfTriangle.
struct LightTable {
    std::vector<shared::Light> lights; ///< at infinity, then other inputs, then triangles; input order within each
    std::vector<shared::AliasEntry> alias;
    std::vector<uint32_t> lightOfTriangle;
    std::vector<uint32_t> lightOfInput; ///< per LightInput; kNone: emits nothing
    std::vector<uint32_t> firstLight;   ///< per EmissiveMeshInput, into lightOfTriangle; kNone: emits nothing
    uint32_t infiniteCount = 0;         ///< lights at infinity
    double power = 0; ///< W, luminance-weighted: of area lights emitted, of others into the scene's bounds
};

/// Render space = world - `origin`. `sceneRadius` (metres) bounds what lights at infinity shine on; 0 or less counts
/// as 1. Lights are chosen in proportion to power, mixed with a tenth for all alike, so that strong lights that nobody
/// sees don't hide the others; Light::selection is exactly that of the alias table. Lights without area and degenerate
/// triangles are left out; so is, with a warning, what is not finite.
LightTable buildLightTable(std::span<const LightInput> inputs, std::span<const EmissiveMeshInput> meshes,
                           glm::dvec3 origin, double sceneRadius);

} // namespace trilume
