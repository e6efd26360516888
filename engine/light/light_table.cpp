#include "light/light_table.h"

#include "core/log.h"
#include "light/alias_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace trilume {
namespace {

using std::numbers::pi;

constexpr double kUniformShare = 1e-3;

double luminance(glm::dvec3 c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

bool isFinite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Unit, or `otherwise` where v has no direction.
glm::dvec3 direction(glm::dvec3 v, glm::dvec3 otherwise) {
    const double length = glm::length(v);
    return length > 0 && std::isfinite(length) ? v / length : otherwise;
}

/// Area of the image of the unit sphere: |cofactor(m) n| over the sphere, by the midpoint rule, which is exact for
/// similarities and otherwise good to 1e-4 up to aspect 10.
double ellipsoidArea(const glm::dmat3& m) {
    constexpr int kSteps = 128;
    const glm::dvec3 cx = glm::cross(m[1], m[2]), cy = glm::cross(m[2], m[0]), cz = glm::cross(m[0], m[1]);
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double z = (2 * i + 1.0) / kSteps - 1, r = std::sqrt(1 - z * z);
        for (int j = 0; j < kSteps; ++j) {
            const double phi = 2 * pi * j / kSteps;
            sum += glm::length(r * std::cos(phi) * cx + r * std::sin(phi) * cy + z * cz);
        }
    }
    return 4 * pi * sum / (kSteps * kSteps);
}

/// Lateral area of the cylinder about `axis` (full length) with half axes v and w.
double cylinderArea(glm::dvec3 axis, glm::dvec3 v, glm::dvec3 w) {
    constexpr int kSteps = 256;
    double sum = 0;
    for (int j = 0; j < kSteps; ++j) {
        const double phi = 2 * pi * j / kSteps;
        sum += glm::length(glm::cross(axis, std::cos(phi) * w - std::sin(phi) * v));
    }
    return 2 * pi * sum / kSteps;
}

struct Emitter {
    shared::Light light{};
    double power = 0; ///< W, by luminance
};

/// What is gathered before selection probabilities are known.
struct Emitters {
    std::vector<shared::Light> lights;
    std::vector<double> powers;

    uint32_t add(const Emitter& e) {
        lights.push_back(e.light);
        powers.push_back(e.power);
        return uint32_t(lights.size() - 1);
    }
};

/// Projected solid angle of a cone, the divisor of UsdLux's `normalize` for distant lights (LightAPI documentation).
double distantSizeFactor(double halfAngle) {
    const double s = std::sin(halfAngle);
    return halfAngle <= pi / 2 ? s * s * pi : (2 - s * s) * pi;
}

/// Fills geometry, radiance and power; false when the light emits nothing that can be sampled.
bool placeLight(const LightInput& input, glm::dvec3 origin, double sceneRadius, Emitter& e) {
    const Light& c = *input.component;
    const glm::dmat3 linear(input.worldFromLocal);
    const glm::dvec3 x = linear[0], y = linear[1], z = linear[2];
    const double handedness = glm::determinant(linear) < 0 ? -1 : 1;
    glm::dvec3 radiance(c.radiance), u(0), v(0), normal(0, 0, 1);
    double area = 0, radius = 0, measure = 0; // power = luminance(radiance) * measure

    e.light.cosHalfAngle = 1;
    switch (c.kind) {
    case LightKind::Rect:
        e.light.kind = shared::kLightRect;
        u = x * double(c.width), v = y * double(c.height);
        area = glm::length(glm::cross(u, v));
        normal = direction(-handedness * glm::cross(u, v), normal);
        break;
    case LightKind::Disk:
        e.light.kind = shared::kLightDisk;
        u = x * double(c.radius), v = y * double(c.radius);
        area = pi * glm::length(glm::cross(u, v));
        normal = direction(-handedness * glm::cross(u, v), normal);
        break;
    case LightKind::Sphere:
        e.light.kind = shared::kLightSphere;
        u = x * double(c.radius), v = y * double(c.radius);
        radius = glm::length(z) * c.radius;
        normal = direction(z, normal);
        if (glm::determinant(glm::dmat3(u, v, z * double(c.radius))) != 0) {
            area = ellipsoidArea(glm::dmat3(u, v, normal * radius));
        }
        break;
    case LightKind::Cylinder:
        e.light.kind = shared::kLightCylinder;
        u = x * double(c.length), v = y * double(c.radius);
        radius = glm::length(z) * c.radius;
        normal = direction(z, normal);
        if (glm::determinant(glm::dmat3(u, v, z * double(c.radius))) != 0) area = cylinderArea(u, v, normal * radius);
        break;
    case LightKind::Distant: {
        e.light.kind = shared::kLightDistant;
        const double halfAngle = std::clamp(glm::radians(double(c.angle)) / 2, 0.0, pi);
        normal = direction(-z, -normal);
        u = direction(x, {1, 0, 0}), v = direction(y, {0, 1, 0});
        radius = 2 * std::pow(std::sin(halfAngle / 2), 2);
        e.light.cosHalfAngle = float(std::cos(halfAngle));
        measure = distantSizeFactor(halfAngle);
        if (float(radius) > 0) {
            if (c.normalize) radiance /= measure;
        } else { // one direction: irradiance
            if (halfAngle > 0 && !c.normalize) radiance *= measure;
            radius = 0;
            measure = 1;
        }
        measure *= pi * sceneRadius * sceneRadius;
        break;
    }
    case LightKind::Dome:
        e.light.kind = shared::kLightDome;
        v = direction(y, {0, 1, 0});
        u = direction(x - v * glm::dot(x, v), {1, 0, 0});
        normal = direction(z - v * glm::dot(z, v) - u * glm::dot(z, u), glm::cross(u, v));
        measure = 4 * pi * pi * sceneRadius * sceneRadius;
        break;
    }
    const bool infinite = c.kind == LightKind::Distant || c.kind == LightKind::Dome;
    if (!infinite) {
        if (c.normalize) radiance /= area; // not finite for area 0: refused below
        measure = pi * area;
        if (!(float(area) > 0)) return false;
    }
    if (!(luminance(radiance) > 0)) return false;

    e.light.radiance = glm::vec3(radiance);
    e.light.position = infinite ? glm::vec3(0) : glm::vec3(glm::dvec3(input.worldFromLocal[3]) - origin);
    e.light.area = float(area);
    e.light.axisU = glm::vec3(u);
    e.light.axisV = glm::vec3(v);
    e.light.radius = float(radius);
    e.light.normal = glm::vec3(normal);
    e.light.instance = input.instance;
    e.light.image = input.image;
    e.light.distribution = input.distribution;
    e.light.id = input.id;
    e.power = measure * luminance(radiance * glm::dvec3(input.textureMean));
    return true;
}

/// Radiance with negative channels at 0; nothing where a channel is not finite, said once per `name`.
std::optional<glm::vec3> checkedRadiance(glm::vec3 radiance, const std::string& name) {
    if (!isFinite(radiance)) [[unlikely]] {
        log::writeOnce(log::Level::Warning, "light-radiance:" + name,
                       fmt::format("emission is not finite: {}: it is left out", name));
        return std::nullopt;
    }
    return glm::max(radiance, glm::vec3(0));
}

std::optional<Emitter> makeEmitter(const LightInput& input, glm::dvec3 origin, double sceneRadius) {
    const std::string name = fmt::format("light {}", input.id);
    const std::optional<glm::vec3> radiance = checkedRadiance(input.component->radiance, name);
    if (!radiance) return std::nullopt;
    Light component = *input.component;
    component.radiance = *radiance;
    LightInput checked = input;
    checked.component = &component;
    Emitter e;
    if (!placeLight(checked, origin, sceneRadius, e)) return std::nullopt;
    const shared::Light& l = e.light;
    if (!isFinite(l.position) || !isFinite(l.axisU) || !isFinite(l.axisV) || !isFinite(l.normal) ||
        !isFinite(l.radiance) || !std::isfinite(l.area) || !std::isfinite(l.radius) || !std::isfinite(e.power)) {
        log::writeOnce(log::Level::Warning, "light-geometry:" + name,
                       fmt::format("a size, transform or texture is not finite: {}: it is left out", name));
        return std::nullopt;
    }
    return e;
}

/// Adds the triangles of one mesh; returns whether any emits.
bool addTriangles(const EmissiveMeshInput& input, glm::dvec3 origin, Emitters& emitters,
                  std::vector<uint32_t>& lightOfTriangle) {
    const Mesh& mesh = *input.mesh;
    const glm::dmat3 linear(input.worldFromLocal);
    const glm::dvec3 translation = glm::dvec3(input.worldFromLocal[3]) - origin;
    const double handedness = glm::determinant(linear) < 0 ? -1 : 1;
    const size_t before = emitters.lights.size();
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        lightOfTriangle.push_back(shared::kNone);
        const glm::uvec3 t = mesh.triangles[i];
        if (std::max({t.x, t.y, t.z}) >= mesh.positions.size()) continue;
        const std::optional<glm::vec3> radiance = checkedRadiance(input.radiance(i), mesh.name);
        if (!radiance || !(luminance(*radiance) > 0)) continue;

        const glm::dvec3 p0(mesh.positions[t.x]), p1(mesh.positions[t.y]), p2(mesh.positions[t.z]);
        const glm::dvec3 e1 = linear * (p1 - p0), e2 = linear * (p2 - p0), n = glm::cross(e1, e2);
        const double twice = glm::length(n);
        Emitter e;
        e.light.area = float(0.5 * twice);
        if (!(e.light.area > 0) || !std::isfinite(e.light.area)) continue;
        e.light.kind = shared::kLightTriangle;
        e.light.instance = input.instance;
        e.light.image = input.textured && input.textured(i) ? i : shared::kNone;
        e.light.distribution = shared::kNone;
        e.light.radiance = *radiance;
        e.light.position = glm::vec3(linear * p0 + translation);
        e.light.axisU = glm::vec3(e1);
        e.light.axisV = glm::vec3(e2);
        e.light.cosHalfAngle = 1;
        e.light.normal = glm::vec3(handedness * n / twice);
        e.light.id = input.firstId + i;
        e.power = pi * 0.5 * twice * luminance(*radiance);
        lightOfTriangle.back() = emitters.add(e);
    }
    return emitters.lights.size() > before;
}

bool isInfinite(const LightInput& input) {
    return input.component->kind == LightKind::Distant || input.component->kind == LightKind::Dome;
}

} // namespace

LightTable buildLightTable(std::span<const LightInput> inputs, std::span<const EmissiveMeshInput> meshes,
                           glm::dvec3 origin, double sceneRadius) {
    if (!(sceneRadius > 0) || !std::isfinite(sceneRadius)) sceneRadius = 1;
    LightTable table;
    Emitters emitters;
    table.lightOfInput.assign(inputs.size(), shared::kNone);
    for (const bool infinite : {true, false}) {
        for (size_t i = 0; i < inputs.size(); ++i) {
            if (isInfinite(inputs[i]) != infinite) continue;
            const std::optional<Emitter> e = makeEmitter(inputs[i], origin, sceneRadius);
            if (e) table.lightOfInput[i] = emitters.add(*e);
        }
        if (infinite) table.infiniteCount = uint32_t(emitters.lights.size());
    }
    for (const EmissiveMeshInput& mesh : meshes) {
        const size_t first = table.lightOfTriangle.size();
        const bool emits = addTriangles(mesh, origin, emitters, table.lightOfTriangle);
        if (!emits) table.lightOfTriangle.resize(first);
        table.firstLight.push_back(emits ? uint32_t(first) : shared::kNone);
    }

    const double count = double(emitters.lights.size());
    table.power = std::accumulate(emitters.powers.begin(), emitters.powers.end(), 0.0);
    std::vector<double> weights = std::move(emitters.powers);
    for (double& w : weights) {
        w = (1 - kUniformShare) * (table.power > 0 ? w / table.power : 0) + kUniformShare / count;
    }
    AliasTable alias = buildAliasTable(weights);
    table.alias = std::move(alias.entries);
    table.lights = std::move(emitters.lights);
    for (size_t i = 0; i < table.lights.size(); ++i) table.lights[i].selection = float(alias.probability[i]);
    return table;
}

} // namespace trilume
