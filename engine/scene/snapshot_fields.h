#pragma once

#include "scene/components.h"
#include "scene/mesh_bvh.h"

#include <concepts>
#include <type_traits>

/// What a snapshot keeps of each type, in the file's order: `fields(f, a, b...)` calls f with the same member of each.
/// Writing, reading, comparing and blending all go through here.
namespace trilume::snapshot {

/// Whether an entity is there at a time.
struct Existence {
    bool alive = true;
};
/// How a value goes from its key to the next one.
enum class Blend : uint8_t {
    Hold,
    Linear, ///< each floating point number by itself; the rest holds
    Rigid   ///< of transforms: rotation at constant speed, offset and scale linear
};
/// The parts of a Mesh that vary for themselves.
struct MeshTopology {
    std::vector<glm::uvec3> triangles;
    std::vector<glm::vec2> uvs;
    std::vector<uint32_t> triangleSubset;
};
struct MeshPoints {
    std::vector<glm::vec3> positions, normals;
};

template<class A, class T>
concept Is = std::same_as<std::remove_const_t<A>, T>;

template<class F, Is<Existence>... A>
void fields(F&& f, A&... a) {
    f(a.alive...);
}
template<class F, Is<LocalTransform>... A>
void fields(F&& f, A&... a) {
    for (int column = 0; column < 4; ++column) f(a.parentFromLocal[column]...);
}
template<class F, Is<Visibility>... A>
void fields(F&& f, A&... a) {
    f(a.visible...);
    f(a.camera...);
    f(a.shadow...);
}
template<class F, Is<MeshInstance>... A>
void fields(F&& f, A&... a) {
    f(a.mesh...);
    f(a.materials...);
}
template<class F, Is<SphereInstance>... A>
void fields(F&& f, A&... a) {
    f(a.radius...);
    f(a.material...);
}
template<class F, Is<Light>... A>
void fields(F&& f, A&... a) {
    f(a.kind...);
    f(a.radiance...);
    f(a.width...);
    f(a.height...);
    f(a.radius...);
    f(a.length...);
    f(a.angle...);
    f(a.normalize...);
    f(a.texture...);
    f(a.visibleToCamera...);
}
template<class F, Is<Camera>... A>
void fields(F&& f, A&... a) {
    f(a.verticalAperture...);
    f(a.horizontalAperture...);
    f(a.horizontalOffset...);
    f(a.verticalOffset...);
    f(a.focalLength...);
    f(a.nearClip...);
    f(a.farClip...);
    f(a.fStop...);
    f(a.focusDistance...);
}
template<class F, Is<TextureInput>... A>
void fields(F&& f, A&... a) {
    f(a.texture...);
    f(a.channel...);
    f(a.scale...);
    f(a.bias...);
    f(a.uvTransform...);
}
template<class F, Is<Material>... A>
void fields(F&& f, A&... a) {
    f(a.name...);
    f(a.baseColor...);
    f(a.metallic...);
    f(a.roughness...);
    f(a.ior...);
    f(a.specular...);
    f(a.specularColor...);
    f(a.specularWorkflow...);
    f(a.transmission...);
    f(a.transmissionColor...);
    f(a.clearcoat...);
    f(a.clearcoatRoughness...);
    f(a.clearcoatIor...);
    f(a.emission...);
    f(a.opacity...);
    f(a.opacityThreshold...);
    f(a.baseColorMap...);
    f(a.metallicMap...);
    f(a.roughnessMap...);
    f(a.emissionMap...);
    f(a.opacityMap...);
    f(a.normalMap...);
    f(a.specularColorMap...);
    f(a.clearcoatMap...);
    f(a.clearcoatRoughnessMap...);
    f(a.transmissionMap...);
}
/// Of a MeshTopology or a Mesh.
template<class F, class... A>
requires(... && (Is<A, MeshTopology> || Is<A, Mesh>)) void topologyFields(F&& f, A&... a) {
    f(a.triangles...);
    f(a.uvs...);
    f(a.triangleSubset...);
}
/// Of a MeshPoints or a Mesh.
template<class F, class... A>
requires(... && (Is<A, MeshPoints> || Is<A, Mesh>)) void pointFields(F&& f, A&... a) {
    f(a.positions...);
    f(a.normals...);
}
template<class F, Is<MeshTopology>... A>
void fields(F&& f, A&... a) {
    topologyFields(f, a...);
}
template<class F, Is<MeshPoints>... A>
void fields(F&& f, A&... a) {
    pointFields(f, a...);
}
template<class F, Is<MeshBvh>... A>
void fields(F&& f, A&... a) {
    f(a.nodes...);
    f(a.order...);
    f(a.min...);
    f(a.max...);
    f(a.cost...);
    f(a.depth...);
}
template<class F, Is<Mesh>... A>
void fields(F&& f, A&... a) {
    f(a.name...);
    f(a.deforming...);
    topologyFields(f, a...);
    pointFields(f, a...);
}
template<class F, Is<Texture>... A>
void fields(F&& f, A&... a) {
    f(a.name...);
    f(a.width...);
    f(a.height...);
    f(a.rgba8...);
    f(a.rgba32f...);
    f(a.srgb...);
    f(a.wrapS...);
    f(a.wrapT...);
}

/// A type with fields; all others are values in themselves.
template<class T>
concept Record = requires(T& t) {
    fields([](auto&...) {}, t);
};

/// Values that the file holds as they lie in memory.
template<class T>
concept Plain = std::is_trivially_copyable_v<T> && !std::is_enum_v<T> && !std::same_as<T, bool> && !Record<T>;

} // namespace trilume::snapshot
