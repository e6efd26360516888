#pragma once

#include "gpu/device_table.h"
#include "scene/scene.h"
#include "shared/material.h"

namespace trilume {

/// The device's copy of a scene's textures and materials.
class GpuMaterials {
public:
    explicit GpuMaterials(gpu::Device& device) : device_(device) {}

    /// Follows revisions; returns whether anything changed.
    bool update(const Scene& scene);

    /// Index into the device's table; MaterialId::None gives the default: Lambert, albedo 0.18.
    uint32_t index(MaterialId id) const {
        return id == MaterialId::None ? kDefault : static_cast<uint32_t>(id) + kFirst;
    }
    /// Reflects nothing: the surface of a light.
    static constexpr uint32_t kBlack = 1;

    /// Bindless index, or shared::kNone.
    uint32_t image(TextureId id) const;
    // By index into the device's table.
    const shared::Material& material(uint32_t index) const { return materials_.values()[index]; }
    /// Mean radiance that the material emits, W/(m^2 sr); 0: it does not.
    glm::vec3 emission(uint32_t index) const { return traits_[index].emission; }
    /// Whether emission varies over a surface: by a map, or as parts of it are cut out.
    bool emissionVaries(uint32_t index) const {
        return material(index).emissionMap != 0 || (material(index).flags & shared::kMaterialCutout) != 0;
    }
    bool isDiffuse(uint32_t index) const { return traits_[index].diffuse; }
    /// Has, or may have somewhere, a delta lobe: casts caustics.
    bool castsCaustics(uint32_t index) const { return traits_[index].caustic; }

    VkDeviceAddress materials() const { return materials_.address(); }
    VkDeviceAddress textureInputs() const { return inputs_.address(); }

    // What kernels must be able to do.
    bool textured() const { return textured_; }
    bool cutouts() const { return cutouts_; }
    bool specular() const { return specular_; } ///< any material that is more than Lambert
    bool rough() const { return rough_; }       ///< any whose further lobes are not all deltas
    bool transmissive() const { return transmissive_; }
    bool clearcoated() const { return clearcoated_; }

private:
    static constexpr uint32_t kDefault = 0, kFirst = 2;

    struct DeviceTexture {
        gpu::Image image;
        glm::vec2 black{0}; ///< shared::TextureInput::black
        glm::vec3 mean{0};
        uint64_t revision = 0;
    };

    struct Traits {
        glm::vec3 emission{0};
        bool diffuse = false, caustic = false;
    };

    bool updateTextures(const Scene& scene);
    /// Mean radiance: the emission, times the map's mean where there is one.
    glm::vec3 meanEmission(const Material& material) const;
    uint32_t addInput(std::vector<shared::TextureInput>& inputs, const TextureInput& input) const;
    shared::Material convert(const Material& material, std::vector<shared::TextureInput>& inputs) const;

    gpu::Device& device_;
    std::vector<DeviceTexture> textures_;
    std::vector<uint64_t> revisions_;
    std::vector<Traits> traits_;
    gpu::DeviceTable<shared::Material> materials_{"materials"};
    gpu::DeviceTable<shared::TextureInput> inputs_{"texture inputs"};
    bool textured_ = false, cutouts_ = false, specular_ = false, rough_ = false, transmissive_ = false,
         clearcoated_ = false;
};

} // namespace trilume
