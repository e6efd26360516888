// The query tracer: VK_KHR_ray_query. Exact shapes are procedural boxes in the same structure.
#ifndef TL_SCENE_TRACE_QUERY_GLSL
#define TL_SCENE_TRACE_QUERY_GLSL

#extension GL_EXT_ray_query : require

#include "lib/intersect/shapes.glsl"
#include "shared/scene.h"

#ifdef TL_LAST_FRAME
layout(set = 1, binding = 1) uniform accelerationStructureEXT topLevel;
#else
layout(set = 1, binding = 0) uniform accelerationStructureEXT topLevel;
#endif

// Vulkan instances carry the scene's instance as custom index and its shape as shader-table offset, which nothing else uses.
bool queryScene(vec3 origin, vec3 direction, float tMin, float tMax, uint mask, uint rayFlags, out Hit hit) {
    hit = Hit(tMax, kNone, 0, vec2(0));
    if (!rayIsValid(origin, direction, tMin, tMax)) return false;

    rayQueryEXT query;
    rayQueryInitializeEXT(query, topLevel, rayFlags, mask, origin, max(tMin, 0), direction, tMax);
    float nearest = tMax;
    while (rayQueryProceedEXT(query)) {
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionAABBEXT) {
            const uint shape = rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(query, false);
            const float t = intersectShape(shape, rayQueryGetIntersectionObjectRayOriginEXT(query, false),
                                           rayQueryGetIntersectionObjectRayDirectionEXT(query, false), tMin, nearest);
            if (t < nearest) {
                nearest = t;
                rayQueryGenerateIntersectionEXT(query, t);
            }
        }
    }
    const uint type = rayQueryGetIntersectionTypeEXT(query, true);
    if (type == gl_RayQueryCommittedIntersectionNoneEXT) return false;
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    hit.instance = rayQueryGetIntersectionInstanceCustomIndexEXT(query, true);
    if (type == gl_RayQueryCommittedIntersectionTriangleEXT) {
        hit.primitive = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
        hit.uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
    }
    return true;
}

bool traceClosest(vec3 origin, vec3 direction, float tMin, float tMax, uint mask, out Hit hit) {
    return queryScene(origin, direction, tMin, tMax, mask, gl_RayFlagsOpaqueEXT, hit);
}

bool traceAny(vec3 origin, vec3 direction, float tMin, float tMax, uint mask) {
    Hit hit;
    return queryScene(origin, direction, tMin, tMax, mask, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, hit);
}

#endif
