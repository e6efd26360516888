// What a pixel remembers of earlier frames: the mean of its caustic and how many frames are in it. Light and things were
// the same in all of them; where only the camera moved, the point is looked up where it was seen then.
#ifndef TL_CAUSTICS_HISTORY_GLSL
#define TL_CAUSTICS_HISTORY_GLSL

#include "passes/caustics/push.glsl"

#include "scene/camera.glsl"
#include "scene/visible_point.glsl"

// w: frames; 0: nothing.
vec4 remembered(uint index, VisiblePoint point) {
    if ((push.flags & kCausticsUnchanged) == 0u) return vec4(0.0);
    if ((push.flags & kCausticsCameraMoved) == 0u) return push.previousMean.v[index];
    if (point.instance == kNone || point.chain > 0u) return vec4(0.0);
    const Surface s = loadSurface(visibleHit(point));
    vec2 film;
    if (!projectToFilm(TL_FRAME.previousCamera, s.position, film)) return vec4(0.0);
    const ivec2 pixel = ivec2(floor(film * vec2(TL_FRAME.width, TL_FRAME.height)));
    if (any(lessThan(pixel, ivec2(0))) || !insideView(uvec2(pixel))) return vec4(0.0);
    const uint before = pixelIndex(uvec2(pixel));
    const VisiblePoint there = push.previousPoints.v[before];
    if (there.instance != point.instance || there.chain > 0u) return vec4(0.0);
    const Surface other = loadSurface(visibleHit(there));
    // Two pixels apart at most, as both lie anywhere in theirs; and on one side of an edge.
    const float reach = 2.0 * max(point.footprint, there.footprint);
    const vec3 offset = other.position - s.position;
    const float height = dot(offset, s.geometricNormal);
    if (abs(height) > 0.5 * reach || dot(other.geometricNormal, s.geometricNormal) < 0.8) return vec4(0.0);
    return push.previousMean.v[before];
}

#endif
