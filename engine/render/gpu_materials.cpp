#include "render/gpu_materials.h"

#include "shared/scene.h"

#include <array>
#include <cmath>

namespace trilume {

namespace {

float linearFromSrgb(float x) { return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f); }

glm::vec3 meanOf(const Texture& texture) {
    const size_t count = size_t{texture.width} * texture.height;
    glm::dvec3 sum(0);
    if (!texture.rgba32f.empty()) {
        for (size_t i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c) sum[c] += texture.rgba32f[4 * i + c];
    } else {
        std::array<float, 256> decode;
        for (int i = 0; i < 256; ++i) {
            const auto x = static_cast<float>(i) / 255;
            decode[i] = texture.srgb ? linearFromSrgb(x) : x;
        }
        for (size_t i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c) sum[c] += decode[texture.rgba8[4 * i + c]];
    }
    return count == 0 ? glm::vec3(0) : glm::vec3(sum / static_cast<double>(count));
}

VkSamplerAddressMode addressMode(Wrap wrap) {
    switch (wrap) {
    case Wrap::Clamp:
    case Wrap::Black: // scene/surface.glsl looks at the coordinate: filters would draw black from beyond the edge
        return VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    case Wrap::Mirror:
        return VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT;
    case Wrap::Repeat:
        break;
    }
    return VK_SAMPLER_ADDRESS_MODE_REPEAT;
}

bool mapped(const TextureInput& input) { return input.texture != TextureId::None; }

/// More than Lambert: some lobe besides the diffuse one can be there.
bool hasSpecular(const Material& m) {
    const bool dielectric = m.specularWorkflow ? m.specularColor != glm::vec3(0) || mapped(m.specularColorMap)
                                               : m.ior != 1 && m.specular > 0;
    return dielectric || m.metallic > 0 || mapped(m.metallicMap) || m.transmission > 0 || mapped(m.transmissionMap) ||
           m.clearcoat > 0 || mapped(m.clearcoatMap);
}

bool isCutout(const Material& m) { return m.opacity < 1 || mapped(m.opacityMap); }

/// kDeltaRoughness of shaders/lib/bsdf/bsdf.glsl: a lobe up to it is a delta, by which light that reaches a rough
/// surface is a caustic. A map may hold such a value anywhere.
constexpr float kDeltaRoughness = 0.01f;

/// Whether any lobe besides the diffuse one can have a roughness that `test` (of roughness and its map) accepts.
template<class Test>
bool anySpecularLobe(const Material& m, Test test) {
    Material base = m;
    base.clearcoat = 0;
    base.clearcoatMap = {};
    return (hasSpecular(base) && test(m.roughness, mapped(m.roughnessMap))) ||
           ((m.clearcoat > 0 || mapped(m.clearcoatMap)) && test(m.clearcoatRoughness, mapped(m.clearcoatRoughnessMap)));
}

bool hasCausticLobe(const Material& m) {
    return anySpecularLobe(m, [](float roughness, bool map) { return map || roughness <= kDeltaRoughness; });
}

bool hasRoughLobe(const Material& m) {
    return anySpecularLobe(m, [](float roughness, bool map) { return map || roughness > kDeltaRoughness; });
}

bool hasDiffuse(const Material& m) {
    return (m.metallic < 1 || m.specularWorkflow) && m.transmission < 1 &&
           (m.baseColor != glm::vec3(0) || mapped(m.baseColorMap));
}

} // namespace

uint32_t GpuMaterials::image(TextureId id) const {
    if (id == TextureId::None) return shared::kNone;
    const DeviceTexture& texture = textures_[static_cast<uint32_t>(id)];
    return texture.image ? texture.image.bindlessIndex() : shared::kNone;
}

glm::vec3 GpuMaterials::meanEmission(const Material& material) const {
    const TextureInput& map = material.emissionMap;
    if (image(map.texture) == shared::kNone) return material.emission;
    const glm::vec3 mean = textures_[static_cast<uint32_t>(map.texture)].mean;
    return glm::max(mean * glm::vec3(map.scale) + glm::vec3(map.bias), glm::vec3(0));
}

bool GpuMaterials::updateTextures(const Scene& scene) {
    bool changed = false;
    textures_.resize(scene.textures().size());
    for (size_t i = 0; i < textures_.size(); ++i) {
        const Texture& source = scene.textures()[i];
        DeviceTexture& texture = textures_[i];
        if (texture.revision == source.revision) continue;
        const bool bytes = source.rgba32f.empty();
        const auto pixels = bytes ? std::as_bytes(std::span(source.rgba8)) : std::as_bytes(std::span(source.rgba32f));
        const VkFormat format = !bytes        ? VK_FORMAT_R32G32B32A32_SFLOAT
                                : source.srgb ? VK_FORMAT_R8G8B8A8_SRGB
                                              : VK_FORMAT_R8G8B8A8_UNORM;
        texture.image = device_.createImage(source.width, source.height, format, pixels,
                                            {addressMode(source.wrapS), addressMode(source.wrapT)}, source.name);
        texture.black = glm::equal(glm::ivec2(int(source.wrapS), int(source.wrapT)), glm::ivec2(int(Wrap::Black)));
        texture.mean = meanOf(source);
        texture.revision = source.revision;
        changed = true;
    }
    return changed;
}

uint32_t GpuMaterials::addInput(std::vector<shared::TextureInput>& inputs, const TextureInput& input) const {
    const uint32_t imageIndex = image(input.texture);
    if (imageIndex == shared::kNone) return 0;
    shared::TextureInput t{};
    t.scale = input.scale;
    t.bias = input.bias;
    t.du = input.uvTransform[0];
    t.dv = input.uvTransform[1];
    t.offset = input.uvTransform[2];
    t.image = imageIndex;
    t.channel = input.channel;
    t.black = textures_[static_cast<size_t>(input.texture)].black;
    inputs.push_back(t);
    return static_cast<uint32_t>(inputs.size() - 1);
}

shared::Material GpuMaterials::convert(const Material& m, std::vector<shared::TextureInput>& inputs) const {
    shared::Material out{};
    out.baseColor = m.baseColor;
    out.metallic = m.metallic;
    out.specularColor = m.specularColor;
    out.roughness = m.roughness;
    out.transmissionColor = m.transmissionColor;
    out.transmission = m.transmission;
    out.emission = m.emission;
    out.ior = m.ior;
    out.specular = m.specular;
    out.clearcoat = m.clearcoat;
    out.clearcoatRoughness = m.clearcoatRoughness;
    out.clearcoatIor = m.clearcoatIor;
    out.opacity = m.opacity;
    out.opacityThreshold = m.opacityThreshold;
    const size_t before = inputs.size();
    out.baseColorMap = addInput(inputs, m.baseColorMap);
    out.metallicMap = addInput(inputs, m.metallicMap);
    out.roughnessMap = addInput(inputs, m.roughnessMap);
    out.emissionMap = addInput(inputs, m.emissionMap);
    out.opacityMap = addInput(inputs, m.opacityMap);
    out.normalMap = addInput(inputs, m.normalMap);
    out.specularColorMap = addInput(inputs, m.specularColorMap);
    out.clearcoatMap = addInput(inputs, m.clearcoatMap);
    out.clearcoatRoughnessMap = addInput(inputs, m.clearcoatRoughnessMap);
    out.transmissionMap = addInput(inputs, m.transmissionMap);
    if (inputs.size() > before) out.flags |= shared::kMaterialTextured;
    if (m.specularWorkflow) out.flags |= shared::kMaterialSpecularWorkflow;
    if (isCutout(m)) out.flags |= shared::kMaterialCutout;
    if (meanEmission(m) != glm::vec3(0)) out.flags |= shared::kMaterialEmissive;
    return out;
}

bool GpuMaterials::update(const Scene& scene) {
    bool changed = updateTextures(scene);
    std::vector<uint64_t> revisions;
    for (const Material& m : scene.materials()) revisions.push_back(m.revision);
    if (!changed && revisions == revisions_ && materials_.size() != 0) return false;
    revisions_ = std::move(revisions);

    std::vector<shared::TextureInput> inputs(1); // entry 0 is "no map"
    std::vector<shared::Material> materials;
    traits_.clear();
    textured_ = cutouts_ = specular_ = rough_ = transmissive_ = clearcoated_ = false;
    const auto add = [&](const Material& m) {
        const shared::Material& out = materials.emplace_back(convert(m, inputs));
        traits_.push_back({meanEmission(m), hasDiffuse(m), hasCausticLobe(m)});
        textured_ |= (out.flags & shared::kMaterialTextured) != 0;
        cutouts_ |= (out.flags & shared::kMaterialCutout) != 0;
        specular_ |= hasSpecular(m);
        rough_ |= hasRoughLobe(m);
        transmissive_ |= m.transmission > 0 || mapped(m.transmissionMap);
        clearcoated_ |= m.clearcoat > 0 || mapped(m.clearcoatMap);
    };
    Material plain;
    plain.ior = 1;
    add(plain);
    plain.baseColor = glm::vec3(0);
    add(plain);
    for (const Material& m : scene.materials()) add(m);
    changed |= inputs_.assign(device_, std::move(inputs));
    changed |= materials_.assign(device_, std::move(materials));
    return changed;
}

} // namespace trilume
