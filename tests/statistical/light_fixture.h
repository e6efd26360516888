#pragma once

#include "gpu/gpu_fixture.h"
#include "light/distribution2d.h"
#include "light/light_table.h"

#include <glm/gtc/matrix_transform.hpp>

namespace trilume::test {

inline Texture spottedTexture(uint32_t width, uint32_t height) {
    Texture texture;
    texture.name = "spots";
    texture.width = width;
    texture.height = height;
    texture.rgba32f.assign(size_t(4) * width * height, 0.0f);
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            // Asymmetric, with a bright spot and a black part, so that a flipped axis shows.
            const float value =
                x < width / 4 ? 0.0f : float(1 + (x * 7 + y * 3) % 5) + (x == 5 && y == 2 ? 60.0f : 0.0f);
            for (int c = 0; c < 3; ++c) texture.rgba32f[4 * (size_t(y) * width + x) + c] = value;
        }
    }
    return texture;
}

inline glm::dmat4 place(glm::dvec3 translation, glm::dvec3 scale = glm::dvec3(1), double degrees = 0,
                        glm::dvec3 axis = {0, 0, 1}) {
    return glm::scale(glm::rotate(glm::translate(glm::dmat4(1), translation), glm::radians(degrees), axis), scale);
}

/// Lights and their textures on the device, as the engine builds them.
class LightTest : public GpuTest {
protected:
    static shared::Light build(const Light& component, const glm::dmat4& worldFromLocal, bool textured = false) {
        const LightInput input{
            .component = &component, .worldFromLocal = worldFromLocal, .distribution = textured ? 0 : shared::kNone};
        return buildLightTable(std::span(&input, 1), {}, glm::dvec3(0), 1).lights.at(0);
    }

    static shared::Light triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
        Mesh mesh;
        mesh.positions = {a, b, c};
        mesh.triangles = {{0, 1, 2}};
        const EmissiveMeshInput input{.mesh = &mesh, .radiance = [](uint32_t) { return glm::vec3(1); }};
        return buildLightTable({}, std::span(&input, 1), glm::dvec3(0), 1).lights.at(0);
    }

    void setTexture(const Texture& texture, TextureDomain domain) {
        const TextureDistribution d = buildTextureDistribution(texture, domain);
        marginal_ = bufferOf(d.marginal);
        conditional_ = bufferOf(d.conditional);
        density_ = bufferOf(d.density);
        distributions_ = bufferOf(std::vector<shared::Distribution>{
            {marginal_.address(), conditional_.address(), density_.address(), d.width, d.height}});
    }

    /// 0 until there is a texture.
    uint64_t distributions() const { return distributions_.address(); }

private:
    gpu::Buffer marginal_, conditional_, density_, distributions_;
};

} // namespace trilume::test
