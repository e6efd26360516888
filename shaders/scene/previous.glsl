// From this frame to the one before it. Nothing here is needed in frames that follow no change.
#ifndef TL_SCENE_PREVIOUS_GLSL
#define TL_SCENE_PREVIOUS_GLSL

#include "scene/camera.glsl"
#include "scene/surface.glsl"

bool frameFlag(uint flag) { return (TL_FRAME.flags & flag) != 0u; }

// A light's index now by that of last frame, and the reverse; kNone where there is none.
uint currentLight(uint previous) { return frameFlag(kFrameLightsRenumbered) ? TL_FRAME.currentLight.v[previous] : previous; }
uint previousLight(uint current) { return frameFlag(kFrameLightsRenumbered) ? TL_FRAME.previousLight.v[current] : current; }

// The pixel that showed surface `s`, seen at `pixel` after `chain` specular bounces, and how far it was along the path; false
// where it was out of view. Mirrors and glass are taken to show in the same pixel what they did.
bool previousPixel(Surface s, uint chain, inout uvec2 pixel, inout float depth) {
    if (!frameFlag(kFrameChanged) || chain > 0u) return true;
    vec2 film;
    if (!projectToFilm(TL_FRAME.previousCamera, s.previousPosition, film)) return false;
    if (any(lessThan(film, vec2(0.0))) || any(greaterThanEqual(film, vec2(1.0)))) return false;
    const uvec2 size = uvec2(TL_FRAME.width, TL_FRAME.height);
    pixel = min(uvec2(film * vec2(size)), size - 1u);
    depth = length(s.previousPosition - TL_FRAME.previousCamera.position);
    return true;
}

#endif
