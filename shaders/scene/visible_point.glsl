// The visibility node's points, brought back to surfaces.
#ifndef TL_SCENE_VISIBLE_POINT_GLSL
#define TL_SCENE_VISIBLE_POINT_GLSL

#include "scene/shading.glsl"
#include "shared/visibility.h"

Hit visibleHit(VisiblePoint point) { return Hit(0.0, point.instance, point.primitive, point.uv); }

Shading shadeVisiblePoint(VisiblePoint point) {
    return prepareShading(loadSurface(visibleHit(point)), -point.direction, point.footprint);
}

#endif
