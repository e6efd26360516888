// From a hit to a surface point: geometry, and the material's textures applied.
#ifndef TL_SCENE_SURFACE_GLSL
#define TL_SCENE_SURFACE_GLSL

#include "lib/bsdf/bsdf.glsl"
#include "lib/math.glsl"
#include "lib/octahedral.glsl"
#include "scene/bindings.glsl"
#include "scene/trace.glsl"

struct Surface {
    vec3 position;
    vec3 previousPosition; // where the point was last frame
    vec3 geometricNormal;  // unit, on the front side
    vec3 shadingNormal;    // unit, same side as geometricNormal
    vec3 tangent;          // unit, along increasing s where there are texture coordinates, else arbitrary
    float handedness;      // 1: t increases along cross(shadingNormal, tangent); -1, where textures are mirrored: against it
    vec2 uv;
    uint material;
    uint light;            // the sampled light that this point belongs to, or kNone
    float extent;          // size of the coordinates behind `position`, for ray offsets
    float uvDensity;       // sqrt of texture area per world area
};

vec3 transformPoint(mat4x3 m, vec3 p) { return m * vec4(p, 1.0); }
vec3 transformVector(mat4x3 m, vec3 v) { return mat3(m) * v; }
// Normals transform by the inverse transpose.
vec3 transformNormal(mat4x3 inverse, vec3 n) { return n * mat3(inverse); }

// Replaces uv of hits on shapes by what loadSurface needs, so that a hit stands for itself, without its ray:
// sphere: octahedral local normal; rect: position in [0,1]^2; disk: local x, y; cylinder: x + 1/2 and turn about x.
void completeHit(inout Hit hit, vec3 origin, vec3 direction) {
    const Instance instance = TL_SCENE.instances.v[hit.instance];
    if (instance.shape == kShapeMesh) return;
    const vec3 p = transformPoint(instance.localFromWorld, origin + hit.t * direction);
    if (instance.shape == kShapeSphere) hit.uv = octahedralEncode(safeNormalize(p, vec3(0.0, 0.0, 1.0)));
    else if (instance.shape == kShapeRect) hit.uv = clamp(p.xy + 0.5, 0.0, 1.0);
    else if (instance.shape == kShapeDisk) hit.uv = p.xy;
    else hit.uv = vec2(p.x + 0.5, atan(p.z, p.y) * (0.5 / kPi) + 0.5);
}

Surface loadMeshSurface(Hit hit, Instance instance) {
    Mesh mesh = TL_SCENE.meshes.v[instance.mesh];
    const uvec3 corners = mesh.triangles.v[hit.primitive];
    const vec3 p0 = mesh.positions.v[corners.x];
    const vec3 edge1 = mesh.positions.v[corners.y] - p0;
    const vec3 edge2 = mesh.positions.v[corners.z] - p0;
    const vec3 local = p0 + hit.uv.x * edge1 + hit.uv.y * edge2;

    Surface s;
    s.position = transformPoint(instance.worldFromLocal, local);
    s.previousPosition = transformPoint(instance.previousWorldFromLocal, local);
    const vec3 e1 = transformVector(instance.worldFromLocal, edge1);
    const vec3 e2 = transformVector(instance.worldFromLocal, edge2);
    const float scale = max(maxComponent(abs(e1)), maxComponent(abs(e2)));
    const vec3 doubleArea = cross(e1 / scale, e2 / scale);
    const float side = (instance.flags & kInstanceFlips) != 0u ? -1.0 : 1.0;
    s.geometricNormal = safeNormalize(side * doubleArea, vec3(0.0, 0.0, 1.0));
    s.shadingNormal = s.geometricNormal;
    const uint corner = 3u * hit.primitive;
    const float w = 1.0 - hit.uv.x - hit.uv.y;
    if ((mesh.flags & kMeshHasNormals) != 0u) {
        const vec3 n = w * mesh.normals.v[corner] + hit.uv.x * mesh.normals.v[corner + 1u] +
                       hit.uv.y * mesh.normals.v[corner + 2u];
        s.shadingNormal = safeNormalize(transformNormal(instance.localFromWorld, n), s.geometricNormal);
        if (dot(s.shadingNormal, s.geometricNormal) < 0.0) s.shadingNormal = -s.shadingNormal;
    }
    s.uv = hit.uv;
    s.tangent = e1 / scale;
    s.handedness = side;
    s.uvDensity = 0.0;
    if ((mesh.flags & kMeshHasUvs) != 0u) {
        const vec2 st0 = mesh.uvs.v[corner];
        const vec2 d1 = mesh.uvs.v[corner + 1u] - st0;
        const vec2 d2 = mesh.uvs.v[corner + 2u] - st0;
        s.uv = st0 + hit.uv.x * d1 + hit.uv.y * d2;
        const float determinant = d1.x * d2.y - d1.y * d2.x;
        const float turn = determinant < 0.0 ? -1.0 : 1.0;
        if (determinant != 0.0) s.tangent = turn * (d2.y * (e1 / scale) - d1.y * (e2 / scale));
        s.handedness = turn * side;
        s.uvDensity = sqrt(abs(determinant) / max(length(doubleArea), 1e-30)) / scale;
    }
    s.tangent = safeNormalize(s.tangent, vec3(1.0, 0.0, 0.0));
    const uint subset = (mesh.flags & kMeshHasSubsets) != 0u ? mesh.subsets.v[hit.primitive] : 0u;
    s.material = TL_SCENE.materialIndices.v[instance.firstMaterial + subset];
    s.light = instance.firstLight == kNone ? kNone : TL_SCENE.lightOfTriangle.v[instance.firstLight + hit.primitive];
    // Of the local coordinates that rounding has gone through, before translation; see lib/ray_offset.glsl.
    const mat3 linear = mat3(instance.worldFromLocal);
    s.extent = max(scale, maxComponent(abs(linear[0] * local.x) + abs(linear[1] * local.y) + abs(linear[2] * local.z)));
    return s;
}

Surface loadShapeSurface(Hit hit, Instance instance) {
    vec3 local;
    vec3 normal;
    vec3 tangent = vec3(1.0, 0.0, 0.0);
    Surface s;
    s.uv = hit.uv;
    if (instance.shape == kShapeSphere) {
        local = octahedralDecode(hit.uv);
        normal = local;
        tangent = vec3(local.z, 0.0, -local.x);
        s.uv = vec2(atan(local.x, local.z) * (0.5 / kPi) + 0.5, asin(clamp(local.y, -1.0, 1.0)) / kPi + 0.5);
    } else if (instance.shape == kShapeRect) {
        local = vec3(hit.uv - 0.5, 0.0);
        normal = vec3(0.0, 0.0, -1.0);
    } else if (instance.shape == kShapeDisk) {
        local = vec3(hit.uv, 0.0);
        normal = vec3(0.0, 0.0, -1.0);
    } else {
        const float turn = (hit.uv.y - 0.5) * (2.0 * kPi);
        normal = vec3(0.0, cos(turn), sin(turn));
        local = normal + vec3(hit.uv.x - 0.5, 0.0, 0.0);
    }
    s.position = transformPoint(instance.worldFromLocal, local);
    s.previousPosition = transformPoint(instance.previousWorldFromLocal, local);
    s.geometricNormal = safeNormalize(transformNormal(instance.localFromWorld, normal), vec3(0.0, 0.0, 1.0));
    s.shadingNormal = s.geometricNormal;
    s.tangent = safeNormalize(transformVector(instance.worldFromLocal, tangent), vec3(1.0, 0.0, 0.0));
    s.handedness = (instance.flags & kInstanceFlips) != 0u ? -1.0 : 1.0;
    s.uvDensity = 0.0;
    s.material = TL_SCENE.materialIndices.v[instance.firstMaterial];
    s.light = instance.firstLight;
    s.extent = maxComponent(abs(transformVector(instance.worldFromLocal, vec3(1.0))));
    return s;
}

// The point that a completed hit names.
Surface loadSurface(Hit hit) {
    const Instance instance = TL_SCENE.instances.v[hit.instance];
    if (instance.shape == kShapeMesh) return loadMeshSurface(hit, instance);
    return loadShapeSurface(hit, instance);
}

// One material input: `value` where there is no map. `footprint` is the world-space width that the sample stands for.
vec4 textured(uint map, vec4 value, Surface s, float footprint) {
    if (map == 0u) return value;
    const TextureInput t = TL_SCENE.textureInputs.v[map];
    const vec2 st = s.uv.x * t.du + s.uv.y * t.dv + t.offset;
    const vec2 size = vec2(textureSize(textures[nonuniformEXT(t.image)], 0));
    const float stretch = sqrt(abs(t.du.x * t.dv.y - t.du.y * t.dv.x) * size.x * size.y);
    const float lod = log2(max(footprint * s.uvDensity * stretch, 1.0));
    const vec2 beyond = vec2(greaterThan(abs(st - 0.5), vec2(0.5)));
    const vec4 texel = dot(beyond, t.black) > 0.0 ? vec4(0.0) : sampleTexture(t.image, st, lod);
    return (t.channel < 0 ? texel : vec4(texel[t.channel])) * t.scale + t.bias;
}

BsdfParams loadBsdfParams(Material m, Surface s, float footprint) {
    BsdfParams p;
    p.baseColor = m.baseColor;
    p.metallic = m.metallic;
    p.specularColor = m.specularColor;
    p.roughness = m.roughness;
    p.transmissionColor = m.transmissionColor;
    p.transmission = m.transmission;
    p.ior = m.ior;
    p.specular = m.specular;
    p.clearcoat = m.clearcoat;
    p.clearcoatRoughness = m.clearcoatRoughness;
    p.clearcoatIor = m.clearcoatIor;
    p.specularWorkflow = (m.flags & kMaterialSpecularWorkflow) != 0u;
#if TL_TEXTURES
    if ((m.flags & kMaterialTextured) != 0u) {
        p.baseColor = textured(m.baseColorMap, vec4(m.baseColor, 0.0), s, footprint).rgb;
        p.metallic = textured(m.metallicMap, vec4(m.metallic), s, footprint).r;
        p.roughness = textured(m.roughnessMap, vec4(m.roughness), s, footprint).r;
        p.specularColor = textured(m.specularColorMap, vec4(m.specularColor, 0.0), s, footprint).rgb;
        p.clearcoat = textured(m.clearcoatMap, vec4(m.clearcoat), s, footprint).r;
        p.clearcoatRoughness = textured(m.clearcoatRoughnessMap, vec4(m.clearcoatRoughness), s, footprint).r;
        p.transmission = textured(m.transmissionMap, vec4(m.transmission), s, footprint).r;
        p.baseColor = clamp(p.baseColor, 0.0, 1.0);
        p.specularColor = clamp(p.specularColor, 0.0, 1.0);
        p.metallic = clamp(p.metallic, 0.0, 1.0);
        p.roughness = clamp(p.roughness, 0.0, 1.0);
        p.clearcoat = clamp(p.clearcoat, 0.0, 1.0);
        p.clearcoatRoughness = clamp(p.clearcoatRoughness, 0.0, 1.0);
        p.transmission = clamp(p.transmission, 0.0, 1.0);
    }
#endif
    return p;
}

// Presence in [0,1]: the share of rays that the surface stops.
float loadOpacity(Material m, Surface s, float footprint) {
    float opacity = m.opacity;
#if TL_TEXTURES
    opacity = textured(m.opacityMap, vec4(m.opacity), s, footprint).r;
#endif
    if (m.opacityThreshold > 0.0) return opacity < m.opacityThreshold ? 0.0 : 1.0;
    return clamp(opacity, 0.0, 1.0);
}

// Emitted radiance of the material, front side only.
vec3 loadEmission(Material m, Surface s, float footprint) {
#if TL_TEXTURES
    return max(textured(m.emissionMap, vec4(m.emission, 0.0), s, footprint).rgb, vec3(0.0));
#else
    return m.emission;
#endif
}

// The shading normal on the side of `wo`, normal-mapped, bent so that `wo` stays above the horizon.
vec3 facingNormal(Material m, Surface s, vec3 wo, float footprint) {
    vec3 n = s.shadingNormal;
#if TL_TEXTURES
    if (m.normalMap != 0u) {
        const vec3 t = textured(m.normalMap, vec4(0.0, 0.0, 1.0, 0.0), s, footprint).xyz;
        const vec3 tangent = safeNormalize(s.tangent - n * dot(n, s.tangent), s.tangent);
        n = safeNormalize(t.x * tangent + (t.y * s.handedness) * cross(n, tangent) + t.z * n, n);
    }
#endif
    const float side = dot(s.geometricNormal, wo) < 0.0 ? -1.0 : 1.0;
    n *= side;
    const float above = dot(n, wo);
    const float geometric = abs(dot(s.geometricNormal, wo));
    if (above <= 0.0 && geometric > 0.0)
        n = safeNormalize(n + side * s.geometricNormal * (1e-3 - above / geometric), side * s.geometricNormal);
    return n;
}

#endif
