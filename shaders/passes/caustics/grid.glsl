// This frame's photons by place: cells of a hash grid, each a list.
#ifndef TL_CAUSTICS_GRID_GLSL
#define TL_CAUSTICS_GRID_GLSL

#include "lib/rng.glsl"
#include "passes/caustics/push.glsl"

// Twice the radius of a pixel that sees the far side of the scene: no radius is larger.
float gatherCellSize() {
    const float distance = length(TL_FRAME.camera.position - TL_SCENE.boundsCenter) + TL_SCENE.boundsRadius;
    return 2.0 * push.gatherRadius * TL_FRAME.camera.pixelAngle * distance;
}

ivec3 gatherCell(vec3 position) { return ivec3(floor(position / gatherCellSize())); }
uint gatherHead(ivec3 cell) { return pcg3d(uvec3(cell)).x & push.headMask; }

#endif
