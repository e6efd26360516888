#include "records.h"

#include "shapes.h"

#include <pybind11/stl.h>

#include <glm/gtc/type_ptr.hpp>

#include <array>
#include <utility>

namespace trilume::usd {
namespace {

template<class T>
T get(const py::dict& record, const char* name) {
    return record[name].cast<T>();
}

glm::vec3 colorFrom(const py::object& value) {
    const auto tuple = py::cast<py::tuple>(value);
    return {tuple[0].cast<float>(), tuple[1].cast<float>(), tuple[2].cast<float>()};
}

glm::vec4 vec4From(const py::object& value) {
    const auto tuple = py::cast<py::tuple>(value);
    return {tuple[0].cast<float>(), tuple[1].cast<float>(), tuple[2].cast<float>(), tuple[3].cast<float>()};
}

Interpolation interpolationFrom(const std::string& token) {
    if (token == "constant") return Interpolation::Constant;
    if (token == "uniform") return Interpolation::Uniform;
    if (token == "faceVarying") return Interpolation::FaceVarying;
    return token == "varying" ? Interpolation::Varying : Interpolation::Vertex;
}

template<class T>
std::optional<Primvar<T>> primvarFrom(const py::object& value) {
    if (value.is_none()) return {};
    const auto tuple = py::cast<py::tuple>(value);
    return Primvar<T>{viewOf<T>(tuple[0]), interpolationFrom(tuple[1].cast<std::string>()), viewOf<int>(tuple[2])};
}

std::optional<Wrap> wrapFrom(const std::string& name) {
    if (name == "file") return std::nullopt;
    if (name == "clamp") return Wrap::Clamp;
    if (name == "mirror") return Wrap::Mirror;
    return name == "black" ? Wrap::Black : Wrap::Repeat;
}

ColorSpace colorSpaceFrom(const std::string& name) {
    if (name == "srgb") return ColorSpace::Srgb;
    return name == "linear" ? ColorSpace::Linear : ColorSpace::Auto;
}

TextureInput textureInputFrom(const py::object& record, const FindTexture& findTexture) {
    TextureInput input;
    const auto text = [&](const char* name) { return record.attr(name).cast<std::string>(); };
    input.texture =
        findTexture(text("file"), colorSpaceFrom(text("space")), wrapFrom(text("wrap_s")), wrapFrom(text("wrap_t")));
    if (input.texture == TextureId::None) return {};
    input.channel = record.attr("channel").cast<int>();
    input.scale = vec4From(record.attr("scale"));
    input.bias = vec4From(record.attr("bias"));
    const auto coordinates = record.attr("coordinates").cast<std::array<float, 6>>();
    input.uvTransform = glm::make_mat3x2(coordinates.data());
    return input;
}

Axis axisFrom(const std::string& name) { return name == "X" ? Axis::X : name == "Y" ? Axis::Y : Axis::Z; }

} // namespace

MeshRecord::MeshRecord(const py::dict& record) : owner_(record) {
    polygons.points = viewOf<glm::vec3>(record["points"]);
    polygons.counts = viewOf<int>(record["counts"]);
    polygons.indices = viewOf<int>(record["indices"]);
    polygons.holes = viewOf<int>(record["holes"]);
    for (const py::object& subset : record["subsets"].cast<std::vector<py::object>>())
        polygons.subsets.push_back(viewOf<int>(subset));
    polygons.leftHanded = get<bool>(record, "leftHanded");
    polygons.smooth = get<bool>(record, "smooth");
    polygons.deforming = get<bool>(record, "deforming");
    polygons.normals = primvarFrom<glm::vec3>(record["normals"]);
    polygons.uvs = primvarFrom<glm::vec2>(record["uvs"]);
    sameTopology = get<bool>(record, "sameTopology");
}

Material materialFrom(const std::string& name, const py::dict& record, const FindTexture& findTexture) {
    Material material;
    material.name = name;
    const std::pair<const char*, float*> numbers[] = {
        {"metallic", &material.metallic},
        {"roughness", &material.roughness},
        {"ior", &material.ior},
        {"specular", &material.specular},
        {"transmission", &material.transmission},
        {"clearcoat", &material.clearcoat},
        {"clearcoatRoughness", &material.clearcoatRoughness},
        {"clearcoatIor", &material.clearcoatIor},
        {"opacity", &material.opacity},
        {"opacityThreshold", &material.opacityThreshold},
    };
    const std::pair<const char*, glm::vec3*> colors[] = {
        {"baseColor", &material.baseColor},
        {"specularColor", &material.specularColor},
        {"transmissionColor", &material.transmissionColor},
        {"emission", &material.emission},
    };
    const std::pair<const char*, TextureInput*> maps[] = {
        {"baseColorMap", &material.baseColorMap},
        {"metallicMap", &material.metallicMap},
        {"roughnessMap", &material.roughnessMap},
        {"emissionMap", &material.emissionMap},
        {"opacityMap", &material.opacityMap},
        {"normalMap", &material.normalMap},
        {"specularColorMap", &material.specularColorMap},
        {"clearcoatMap", &material.clearcoatMap},
        {"clearcoatRoughnessMap", &material.clearcoatRoughnessMap},
        {"transmissionMap", &material.transmissionMap},
    };
    for (const auto& [key, value] : numbers)
        if (record.contains(key)) *value = get<float>(record, key);
    for (const auto& [key, value] : colors)
        if (record.contains(key)) *value = colorFrom(record[key]);
    if (record.contains("specularWorkflow")) material.specularWorkflow = get<bool>(record, "specularWorkflow");
    const py::object textures = record["maps"];
    for (const auto& [key, value] : maps)
        if (textures.contains(key)) *value = textureInputFrom(textures[key], findTexture);
    return material;
}

Light lightFrom(const py::dict& record, const FindTexture& findTexture) {
    static constexpr std::pair<const char*, LightKind> kKinds[] = {
        {"Rect", LightKind::Rect},         {"Disk", LightKind::Disk},       {"Sphere", LightKind::Sphere},
        {"Cylinder", LightKind::Cylinder}, {"Distant", LightKind::Distant}, {"Dome", LightKind::Dome},
    };
    Light light;
    const auto name = get<std::string>(record, "light");
    for (const auto& [key, kind] : kKinds)
        if (name == key) light.kind = kind;
    light.radiance = colorFrom(record["radiance"]);
    light.normalize = get<bool>(record, "normalize");
    const std::pair<const char*, float*> sizes[] = {
        {"width", &light.width},   {"height", &light.height}, {"radius", &light.radius},
        {"length", &light.length}, {"angle", &light.angle},
    };
    for (const auto& [key, value] : sizes)
        if (record.contains(key)) *value = get<float>(record, key);
    if (const py::object texture = record["texture"]; !texture.is_none()) {
        // A dome's map closes around the pole's axis.
        const Wrap s = light.kind == LightKind::Dome ? Wrap::Repeat : Wrap::Clamp;
        light.texture = findTexture(texture.cast<std::string>(), ColorSpace::Auto, s, Wrap::Clamp);
    }
    return light;
}

Camera cameraFrom(const py::dict& record) {
    Camera camera;
    const std::pair<const char*, float*> values[] = {
        {"verticalAperture", &camera.verticalAperture},
        {"horizontalAperture", &camera.horizontalAperture},
        {"verticalApertureOffset", &camera.verticalOffset},
        {"horizontalApertureOffset", &camera.horizontalOffset},
        {"focalLength", &camera.focalLength},
        {"nearClip", &camera.nearClip},
        {"farClip", &camera.farClip},
        {"fStop", &camera.fStop},
        {"focusDistance", &camera.focusDistance},
    };
    for (const auto& [key, value] : values) *value = get<float>(record, key);
    return camera;
}

void shapeFrom(const py::dict& record, Mesh& mesh) {
    const auto shape = get<std::string>(record, "shape");
    const auto number = [&](const char* name) { return get<double>(record, name); };
    mesh.deforming = get<bool>(record, "deforming");
    if (shape == "Cube") return buildCube(number("size"), mesh);
    const Axis axis = axisFrom(get<std::string>(record, "axis"));
    if (shape == "Plane") return buildPlane(number("width"), number("length"), axis, mesh);
    const auto build = shape == "Capsule" ? buildCapsule : buildCylinder;
    build(number("radiusBottom"), number("radiusTop"), number("height"), axis, mesh);
}

} // namespace trilume::usd
