// The visibility node's points, brought back to surfaces.
#ifndef TL_SCENE_VISIBLE_POINT_GLSL
#define TL_SCENE_VISIBLE_POINT_GLSL

#include "scene/shading.glsl"
#include "shared/visibility.h"

Shading shadeVisiblePoint(VisiblePoint point) {
    Hit hit;
    hit.t = 0.0;
    hit.instance = point.instance;
    hit.primitive = point.primitive;
    hit.uv = point.uv;
    return prepareShading(loadSurface(hit), -point.direction, point.footprint);
}

#endif
