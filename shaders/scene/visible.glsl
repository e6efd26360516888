// Rays through cut-out surfaces: closest hits that count, and the share of light between two points.
#ifndef TL_SCENE_VISIBLE_GLSL
#define TL_SCENE_VISIBLE_GLSL

#include "lib/ray_offset.glsl"
#include "lib/rng.glsl"
#include "lib/light/sample.glsl"
#include "scene/surface.glsl"

// Rays that this invocation has traced, for the statistics.
uint rayCount = 0u;

const uint kMaxCutouts = 64u; // surfaces that one ray may pass; the next one is taken as opaque

float hitOpacity(Hit hit, out Surface s) {
    s = loadSurface(hit);
    const Material m = TL_SCENE.materials.v[s.material];
    return (m.flags & kMaterialCutout) != 0u ? loadOpacity(m, s, 0.0) : 1.0;
}

// Side of the surface that direction `wi` leaves to.
vec3 sideTowards(Surface s, vec3 wi) { return dot(wi, s.geometricNormal) < 0.0 ? -s.geometricNormal : s.geometricNormal; }

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
        const vec3 next = offsetRayOrigin(s.position, sideTowards(s, direction), s.extent);
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

// Share of light that passes along a segment: 1 where nothing blocks it, 0 where something does; between with cut-outs.
// tMax is 1, and `direction` spans the segment without its end, or kFloatMax for a ray to infinity. `mask`: what can block.
float segmentVisibility(vec3 origin, vec3 direction, float tMax, uint mask) {
#if TL_CUTOUTS
    const vec3 end = origin + direction;
    float share = 1.0;
    for (uint i = 0u; i < kMaxCutouts; ++i) {
        Hit hit;
        ++rayCount;
        if (!traceClosest(origin, direction, 0.0, tMax, mask, hit)) return share;
        completeHit(hit, origin, direction);
        Surface blocker;
        share *= 1.0 - hitOpacity(hit, blocker);
        if (share <= 0.0) return 0.0;
        origin = offsetRayOrigin(blocker.position, sideTowards(blocker, direction), blocker.extent);
        if (tMax < kFloatMax) {
            // Aimed anew: moved along with the origin, the end could lie inside its light.
            if (dot(end - origin, direction) <= 0.0) return share;
            direction = end - origin;
        }
    }
    return 0.0;
#else
    ++rayCount;
    return traceAny(origin, direction, 0.0, tMax, mask) ? 0.0 : 1.0;
#endif
}

// From `s` to the point on a light that lies `distance` along unit `wi`. Both ends are moved off their surfaces, and the
// ray aims from one to the other: at a light's silhouette, an origin moved alone would find the light shadowing itself.
float visibilityToLight(Surface s, vec3 wi, float distance, vec3 lightNormal, float lightExtent) {
    const vec3 origin = offsetRayOrigin(s.position, sideTowards(s, wi), s.extent);
    if (distance >= kLightAtInfinity) return segmentVisibility(origin, wi, kFloatMax, kMaskShadow);
    const float magnitude = maxComponent(abs(s.position)) + distance + lightExtent;
    const vec3 end = offsetRayOrigin(s.position + distance * wi, lightNormal, magnitude);
    return segmentVisibility(origin, end - origin, 1.0, kMaskShadow);
}

#endif
