// Rays through cut-out surfaces: closest hits that count, and the share of light between two points.
#ifndef TL_SCENE_VISIBLE_GLSL
#define TL_SCENE_VISIBLE_GLSL

#include "lib/ray_offset.glsl"
#include "lib/rng.glsl"
#include "scene/surface.glsl"

// Rays that this invocation has traced, for the statistics.
uint rayCount = 0u;

const uint kMaxCutouts = 64u; // surfaces that one ray may pass; the next one is taken as opaque

float hitOpacity(Hit hit, out Surface s) {
    s = loadSurface(hit);
    const Material m = TL_SCENE.materials.v[s.material];
    return (m.flags & kMaterialCutout) != 0u ? loadOpacity(m, s, 0.0) : 1.0;
}

// The closest surface that stops the ray, each with the probability of its opacity. The hit is completed.
bool traceSurface(vec3 origin, vec3 direction, float tMin, float tMax, uint mask, inout Sampler rng, out Hit hit) {
    ++rayCount;
    bool found = traceClosest(origin, direction, tMin, tMax, mask, hit);
    if (found) completeHit(hit, origin, direction);
#if TL_CUTOUTS
    for (uint i = 0u; found && i < kMaxCutouts; ++i) {
        Surface s;
        const float opacity = hitOpacity(hit, s);
        if (opacity >= 1.0 || sample1D(rng) < opacity) return true;
        const float passed = hit.t;
        const vec3 side = dot(direction, s.geometricNormal) < 0.0 ? -s.geometricNormal : s.geometricNormal;
        const vec3 next = offsetRayOrigin(s.position, side, s.extent);
        ++rayCount;
        found = traceClosest(next, direction, 0.0, tMax - passed, mask, hit);
        if (found) {
            completeHit(hit, next, direction);
            hit.t += passed;
        }
    }
#endif
    return found;
}

// 1 where nothing blocks the segment from `s` in direction `wi` (unit) to `distance`, 0 where something does; between
// with cut-outs. Stops short of the far end by 1e-4 of the way, so that a light does not shadow its own points.
float visibility(Surface s, vec3 wi, float distance) {
    const vec3 side = dot(wi, s.geometricNormal) < 0.0 ? -s.geometricNormal : s.geometricNormal;
    vec3 origin = offsetRayOrigin(s.position, side, s.extent);
    float tMax = distance * (1.0 - 1e-4);
#if TL_CUTOUTS
    float share = 1.0;
    for (uint i = 0u; i < kMaxCutouts; ++i) {
        Hit hit;
        ++rayCount;
        if (!traceClosest(origin, wi, 0.0, tMax, kMaskShadow, hit)) return share;
        completeHit(hit, origin, wi);
        Surface blocker;
        share *= 1.0 - hitOpacity(hit, blocker);
        if (share <= 0.0) return 0.0;
        const vec3 beyond = dot(wi, blocker.geometricNormal) < 0.0 ? -blocker.geometricNormal : blocker.geometricNormal;
        origin = offsetRayOrigin(blocker.position, beyond, blocker.extent);
        tMax -= hit.t;
    }
    return 0.0;
#else
    ++rayCount;
    return traceAny(origin, wi, 0.0, tMax, kMaskShadow) ? 0.0 : 1.0;
#endif
}

#endif
