#include "scene/snapshot_track.h"

#include <glm/gtc/quaternion.hpp>

namespace trilume::snapshot {
namespace {

/// linear = rotation * stretch, by Gram-Schmidt: what is applied before the rotation does not mix with it. Mirrors are
/// in the stretch.
struct Rigid {
    glm::dquat rotation;
    glm::dmat3 stretch;

    explicit Rigid(const glm::dmat3& linear) {
        const glm::dvec3 x = glm::normalize(linear[0]);
        const glm::dvec3 y = glm::normalize(linear[1] - x * glm::dot(x, linear[1]));
        const glm::dmat3 axes(x, y, glm::cross(x, y));
        rotation = glm::quat_cast(axes);
        stretch = glm::transpose(axes) * linear;
    }
};

} // namespace

glm::dmat4 rigidlyBlended(const glm::dmat4& a, const glm::dmat4& b, double alpha) {
    const Rigid from{glm::dmat3(a)}, to{glm::dmat3(b)};
    const glm::dmat3 linear = glm::dmat3(glm::mat3_cast(glm::slerp(from.rotation, to.rotation, alpha))) *
                              ((1 - alpha) * from.stretch + alpha * to.stretch);
    glm::dmat4 m(linear);
    m[3] = (1 - alpha) * a[3] + alpha * b[3];
    return m;
}

void normalize(std::vector<glm::vec3>& vectors) {
    for (glm::vec3& v : vectors)
        if (const double length = glm::length(glm::dvec3(v)); length > 0) v = glm::vec3(glm::dvec3(v) / length);
}

} // namespace trilume::snapshot
