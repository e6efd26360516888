// Where photons are aimed: at casters, through cells whose use is learned.
//
// A caster (a ball) fills a cone of directions from a point on a light, or a disk across parallel rays of a light at
// infinity. Both are mapped to the unit square by polar coordinates that keep area, u.x the square of the radius (cone:
// 1 - cos, relative to its largest), u.y the angle; kGuideSide^2 cells of the square are one target each. The density of a
// ray is the sum over all casters that it aims at of P(target) cells / (solid angle of the cone, or area of the disk).
#ifndef TL_CAUSTICS_GUIDE_GLSL
#define TL_CAUSTICS_GUIDE_GLSL

#include "lib/light/numeric.glsl"
#include "lib/sampling.glsl"
#include "passes/caustics/push.glsl"

uint guideGroup(uint light) {
    if (TL_SCENE.lightCount <= kGuideGroups) return light;
    return min(uint(float(light) / float(TL_SCENE.lightCount) * float(kGuideGroups)), kGuideGroups - 1u);
}

struct Cone {
    vec3 axis;
    float oneMinusCos; // 2: all directions
};

Cone casterCone(Caster caster, vec3 point) {
    const vec3 toCenter = caster.center - point;
    const float sine2 = sqr(caster.radius) / dot(toCenter, toCenter);
    if (!(sine2 < 1.0)) return Cone(vec3(0.0, 0.0, 1.0), 2.0);
    return Cone(normalize(toCenter), sine2 / (1.0 + sqrt(1.0 - sine2)));
}

// u.x in [0, 1) where the ray aims at the caster. `density`: of rays uniform over the cone (solid angle) or disk (area).
vec2 casterCoordinates(Caster caster, vec3 point, vec3 direction, bool parallel, out float density) {
    vec2 across;
    float x;
    if (parallel) {
        across = ((point - caster.center) * basisAround(direction)).xy / caster.radius;
        x = dot(across, across);
        density = kInvPi / sqr(caster.radius);
    } else {
        const Cone cone = casterCone(caster, point);
        across = (direction * basisAround(cone.axis)).xy;
        x = 0.5 * lengthSquared(direction - cone.axis) / cone.oneMinusCos; // |d - axis|^2 = 2 (1 - cos)
        density = pdfSolidAngleCone(cone.oneMinusCos);
    }
    return vec2(x, fract(accurateAtan2(across.y, across.x) * kInvTwoPi + 1.0));
}

uint cellAt(vec2 u) {
    const uvec2 cell = min(uvec2(u * float(kGuideSide)), uvec2(kGuideSide - 1u));
    return cell.y * kGuideSide + cell.x;
}

float targetProbability(uint group, uint target) {
    const uint index = group * kGuideTargets + target;
    return push.guide.v[index].cumulative - (target > 0u ? push.guide.v[index - 1u].cumulative : 0.0);
}

uint chooseTarget(uint group, float u) {
    uint low = 0u, high = TL_SCENE.casterCount * kGuideCells - 1u;
    while (low < high) {
        const uint middle = (low + high) / 2u;
        if (push.guide.v[group * kGuideTargets + middle].cumulative > u) high = middle;
        else low = middle + 1u;
    }
    return low;
}

vec2 pointInCell(uint cell, vec2 u) {
    return (vec2(cell % kGuideSide, cell / kGuideSide) + u) / float(kGuideSide);
}

// Density of guided rays, by solid angle (finite lights) or by area across the direction (`parallel`). A ray that was aimed
// at `chosen` counts as inside of it, whatever rounding says.
float guideDensity(uint group, vec3 point, vec3 direction, bool parallel, uint chosen) {
    float sum = 0.0;
    for (uint i = 0u; i < TL_SCENE.casterCount; ++i) {
        float density;
        const vec2 u = casterCoordinates(TL_SCENE.casters.v[i], point, direction, parallel, density);
        if (u.x >= 1.0 && i != chosen) continue;
        const uint target = i * kGuideCells + cellAt(min(u, kOneMinusEpsilon));
        sum += density * float(kGuideCells) * targetProbability(group, target);
    }
    return sum;
}

// Credits the targets that a ray passed through with what it was good for, rounded at random.
void learnFlux(uint group, vec3 point, vec3 direction, bool parallel, float flux, float u) {
    const uint credit = uint(min(flux * float(kGuideUnit) + u, 65536.0));
    if (credit == 0u) return;
    for (uint i = 0u; i < TL_SCENE.casterCount; ++i) {
        float density;
        const vec2 at = casterCoordinates(TL_SCENE.casters.v[i], point, direction, parallel, density);
        if (at.x < 1.0) atomicAdd(push.guide.v[group * kGuideTargets + i * kGuideCells + cellAt(at)].flux, credit);
    }
}

#endif
