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

/// Of samples that go to all lights alike: strong lamps that nobody sees must not hide the others. No weight grows by
/// more than 1 / (1 - share).
constexpr double kUniformShare = 0.1;

double luminance(glm::dvec3 c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

bool isInfinite(const Light& light) { return light.kind == LightKind::Distant || light.kind == LightKind::Dome; }

bool isFinite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Unit, or `otherwise` where v has no direction.
glm::dvec3 direction(glm::dvec3 v, glm::dvec3 otherwise) {
    const double length = glm::length(v);
    return length > 0 && std::isfinite(length) ? v / length : otherwise;
}

/// Area of the ellipsoid with half axes u, v and w: the cofactor matrix maps normals times area elements. By the
/// midpoint rule, good to 1e-4 up to aspect 10.
double ellipsoidArea(glm::dvec3 u, glm::dvec3 v, glm::dvec3 w) {
    constexpr int kSteps = 128;
    const glm::dvec3 cx = glm::cross(v, w), cy = glm::cross(w, u), cz = glm::cross(u, v);
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

/// Whether a and b are orthogonal and equally long, to within float rounding.
bool alike(glm::dvec3 a, glm::dvec3 b) {
    const double aa = glm::dot(a, a), bb = glm::dot(b, b);
    return std::abs(aa - bb) <= 1e-6 * aa && std::abs(glm::dot(a, b)) <= 1e-6 * aa;
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

/// Geometry of a light with a surface, but for its position.
void placeSurface(const Light& c, const glm::dmat3& linear, shared::Light& light, double& area) {
    const glm::dvec3 x = linear[0], y = linear[1], z = linear[2];
    const double handedness = glm::determinant(linear) < 0 ? -1 : 1;
    glm::dvec3 u = x * double(c.radius), v = y * double(c.radius), w = z * double(c.radius);
    switch (c.kind) {
    case LightKind::Rect:
        light.kind = shared::kLightRect;
        u = x * double(c.width), v = y * double(c.height);
        w = -handedness * glm::cross(u, v);
        area = glm::length(w);
        break;
    case LightKind::Disk:
        light.kind = shared::kLightDisk;
        w = -handedness * glm::cross(u, v);
        area = pi * glm::length(w);
        break;
    case LightKind::Sphere:
        light.kind = shared::kLightSphere;
        light.radius = float(glm::length(w));
        area = alike(u, v) && alike(v, w) && alike(w, u) ? 4 * pi * glm::dot(w, w) : ellipsoidArea(u, v, w);
        break;
    default:
        light.kind = shared::kLightCylinder;
        u = x * double(c.length);
        light.radius = float(glm::length(w));
        area = cylinderArea(u, v, w);
        break;
    }
    const bool solid = c.kind == LightKind::Sphere || c.kind == LightKind::Cylinder;
    if (solid && glm::dot(glm::cross(u, v), w) == 0) area = 0; // flattened: it has no inside to emit from
    light.axisU = glm::vec3(u);
    light.axisV = glm::vec3(v);
    light.normal = glm::vec3(direction(w, {0, 0, 1}));
    light.area = float(area);
}

/// Directions of a light at infinity.
void placeDirections(const Light& c, const glm::dmat3& linear, shared::Light& light) {
    const glm::dvec3 y = direction(linear[1], {0, 1, 0});
    const glm::dvec3 x = direction(linear[0] - y * glm::dot(linear[0], y), {1, 0, 0});
    const glm::dvec3 z = direction(linear[2], {0, 0, 1});
    light.axisU = glm::vec3(x);
    light.axisV = glm::vec3(y);
    if (c.kind == LightKind::Dome) {
        light.kind = shared::kLightDome;
        light.normal = glm::vec3(direction(z - y * glm::dot(z, y) - x * glm::dot(z, x), glm::cross(x, y)));
    } else {
        light.kind = shared::kLightDistant;
        light.normal = glm::vec3(-z);
    }
}

/// The cone of a distant light, with `normalize` applied. Returns irradiance on a facing surface / radiance.
double placeCone(const Light& c, shared::Light& light, glm::dvec3& radiance) {
    const double halfAngle = std::clamp(glm::radians(double(c.angle)) / 2, 0.0, pi);
    const double sizeFactor = distantSizeFactor(halfAngle);
    light.radius = float(2 * std::pow(std::sin(halfAngle / 2), 2));
    light.cosHalfAngle = float(std::cos(halfAngle));
    if (light.radius > 0) {
        if (c.normalize) radiance /= sizeFactor;
        return sizeFactor;
    }
    if (halfAngle > 0 && !c.normalize) radiance *= sizeFactor; // too narrow for a float: one direction
    return 1;
}

/// Geometry, radiance and power; false when nothing of the light can be sampled.
bool placeLight(const LightInput& input, glm::dvec3 origin, double sceneRadius, Emitter& e) {
    const Light& c = *input.component;
    const glm::dmat3 linear(input.worldFromLocal);
    glm::dvec3 radiance(c.radiance);
    double measure = 0; // power = luminance * measure
    e.light.cosHalfAngle = 1;
    if (isInfinite(c)) {
        placeDirections(c, linear, e.light);
        const double fluence = c.kind == LightKind::Dome ? 4 * pi : placeCone(c, e.light, radiance);
        measure = fluence * pi * sceneRadius * sceneRadius;
    } else {
        double area = 0;
        placeSurface(c, linear, e.light, area);
        if (!(e.light.area > 0)) return false;
        if (c.normalize) radiance /= area;
        measure = pi * area;
        e.light.position = glm::vec3(glm::dvec3(input.worldFromLocal[3]) - origin);
    }
    e.light.radiance = glm::vec3(radiance);
    e.light.instance = input.instance;
    e.light.image = input.image;
    e.light.distribution = input.distribution;
    e.light.id = input.id;
    e.power = measure * luminance(radiance * glm::dvec3(input.textureMean));
    return luminance(radiance) > 0;
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
        e.light.image = input.varies && input.varies(i) ? i : shared::kNone;
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

} // namespace

LightTable buildLightTable(std::span<const LightInput> inputs, std::span<const EmissiveMeshInput> meshes,
                           glm::dvec3 origin, double sceneRadius) {
    if (!(sceneRadius > 0) || !std::isfinite(sceneRadius)) sceneRadius = 1;
    LightTable table;
    Emitters emitters;
    table.lightOfInput.assign(inputs.size(), shared::kNone);
    for (const bool infinite : {true, false}) {
        for (size_t i = 0; i < inputs.size(); ++i) {
            if (isInfinite(*inputs[i].component) != infinite) continue;
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
