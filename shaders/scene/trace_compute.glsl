// The compute tracer: a two-level BVH with quantised four-wide nodes in buffers, walked with one stack.
#ifndef TL_SCENE_TRACE_COMPUTE_GLSL
#define TL_SCENE_TRACE_COMPUTE_GLSL

#include "lib/intersect/shapes.glsl"
#include "lib/intersect/triangle.glsl"
#include "shared/scene.h"

// Leaves without primitives, as marks on the stack.
const uint kTraceLeave = kBvhLeafBit | 1; // back to the top level
const uint kTraceDone = kBvhLeafBit | 2;

// 1 / direction, with components near zero moved away from it, far below what single precision resolves in a position.
vec3 safeInverse(vec3 direction) {
    const vec3 d = abs(direction);
    const float least = 1e-12 * max(max(d.x, d.y), d.z);
    return mix(vec3(1), vec3(-1), lessThan(direction, vec3(0))) / max(d, vec3(least));
}

vec4 unpackBytes(uint word) {
    return vec4(word & 0xffu, (word >> 8) & 0xffu, (word >> 16) & 0xffu, word >> 24);
}

// Where the ray enters each child's box; kBvhMiss where it does not, or not within the limits.
const float kBvhMiss = 3.4e38;
vec4 intersectChildren(BvhNode node, vec3 origin, vec3 inverse, float tMin, float tMax) {
    const vec3 scale =
        uintBitsToFloat((uvec3(node.exponents) << uvec3(23, 15, 7)) & 0x7f800000u);
    // Plane q lies at t = q * slope + start. Both are rounded, relative to themselves, fewer than eight times: widening
    // every interval by that much keeps rays on the borders of boxes from falling through (Ize 2013).
    const vec3 slope = scale * inverse;
    const vec3 start = (node.origin - origin) * inverse;
    const vec3 slack = (abs(start) + 255.0 * abs(slope)) * 4.8e-7;
    const vec3 startNear = start - slack, startFar = start + slack;
    const bvec3 backward = lessThan(inverse, vec3(0));
    const uint nearX = backward.x ? node.highX : node.lowX, farX = backward.x ? node.lowX : node.highX;
    const uint nearY = backward.y ? node.highY : node.lowY, farY = backward.y ? node.lowY : node.highY;
    const uint nearZ = backward.z ? node.highZ : node.lowZ, farZ = backward.z ? node.lowZ : node.highZ;
    const vec4 enter = max(max(unpackBytes(nearX) * slope.x + startNear.x, unpackBytes(nearY) * slope.y + startNear.y),
                           max(unpackBytes(nearZ) * slope.z + startNear.z, vec4(tMin)));
    const vec4 leave = min(min(unpackBytes(farX) * slope.x + startFar.x, unpackBytes(farY) * slope.y + startFar.y),
                           min(unpackBytes(farZ) * slope.z + startFar.z, vec4(tMax)));
    return mix(vec4(kBvhMiss), enter, lessThanEqual(enter, leave));
}

void sortPair(inout float tNear, inout float tFar, inout uint near, inout uint far) {
    const bool swap = tFar < tNear;
    const float t = tNear;
    const uint child = near;
    tNear = swap ? tFar : tNear;
    tFar = swap ? t : tFar;
    near = swap ? far : near;
    far = swap ? child : far;
}

// Walks the scene; `anyHit` is constant at both calls, so that each gets its own code.
bool walkScene(vec3 worldOrigin, vec3 worldDirection, float tMin, float tMax, uint mask, const bool anyHit, out Hit hit) {
    hit = Hit(tMax, kNone, 0, vec2(0));
    if (!rayIsValid(worldOrigin, worldDirection, tMin, tMax)) return false;

    BvhNodeRef topNodes = TL_SCENE.topNodes;
    uintRef topInstances = TL_SCENE.topInstances;
    InstanceRef instances = TL_SCENE.instances;
    MeshRef meshes = TL_SCENE.meshes;

    uint stack[kBvhStackSize + 1];
    stack[0] = kTraceDone;
    uint height = 1;

    const vec3 worldInverse = safeInverse(worldDirection);
    vec3 origin = worldOrigin;
    vec3 inverse = worldInverse;
    BvhNodeRef nodes = topNodes;
    LeafTriangleRef triangles;
    RayShear shear;
    uint instance = kNone; // none: at the top level
    uint next = 0;

    for (;;) {
        while (next < kBvhLeafBit) {
            const BvhNode node = nodes.v[next];
            vec4 t = intersectChildren(node, origin, inverse, tMin, hit.t);
            uint c0 = node.children[0], c1 = node.children[1], c2 = node.children[2], c3 = node.children[3];
            sortPair(t.x, t.y, c0, c1);
            sortPair(t.z, t.w, c2, c3);
            sortPair(t.x, t.z, c0, c2);
            sortPair(t.y, t.w, c1, c3);
            sortPair(t.y, t.z, c1, c2);
            // Farthest first; stores that do not count are overwritten.
            stack[height] = c3;
            height += uint(t.w < kBvhMiss);
            stack[height] = c2;
            height += uint(t.z < kBvhMiss);
            stack[height] = c1;
            height += uint(t.y < kBvhMiss);
            if (t.x < kBvhMiss) {
                next = c0;
            } else {
                next = stack[--height];
            }
        }

        if (next == kTraceDone) break;
        const uint first = next & kBvhLeafFirstMask;
        const uint count = (next >> kBvhLeafCountShift) & kBvhLeafCountMask;
        if (instance == kNone) {
            if (count > 0) {
                const uint entered = topInstances.v[first];
                if ((instances.v[entered].mask & mask) != 0) {
                    const mat4x3 localFromWorld = instances.v[entered].localFromWorld;
                    const vec3 localOrigin = localFromWorld * vec4(worldOrigin, 1);
                    const vec3 localDirection = mat3(localFromWorld) * worldDirection;
                    const uint shape = instances.v[entered].shape;
                    if (shape == kShapeMesh) {
                        const uint mesh = instances.v[entered].mesh;
                        nodes = meshes.v[mesh].nodes;
                        triangles = LeafTriangleRef(meshes.v[mesh].leafVertices);
                        origin = localOrigin;
                        inverse = safeInverse(localDirection);
                        shear = rayShear(localDirection);
                        instance = entered;
                        stack[height++] = kTraceLeave;
                        stack[height++] = 0;
                    } else {
                        const float t = intersectShape(shape, localOrigin, localDirection, tMin, hit.t);
                        if (t < hit.t) hit = Hit(t, entered, 0, vec2(0));
                    }
                }
            }
        } else if (next == kTraceLeave) {
            instance = kNone;
            nodes = topNodes;
            origin = worldOrigin;
            inverse = worldInverse;
        } else {
            for (uint i = first; i < first + count; ++i) {
                const LeafTriangle triangle = triangles.v[i];
                float t;
                vec2 uv;
                if (intersectTriangle(shear, triangle.corner0 - origin, triangle.corner1 - origin,
                                      triangle.corner2 - origin, tMin, hit.t, t, uv)) {
                    hit = Hit(t, instance, triangle.triangle, uv);
                }
            }
        }
        if (anyHit && hit.instance != kNone) break;
        next = stack[--height];
    }
    return hit.instance != kNone;
}

bool traceClosest(vec3 origin, vec3 direction, float tMin, float tMax, uint mask, out Hit hit) {
    return walkScene(origin, direction, tMin, tMax, mask, false, hit);
}

bool traceAny(vec3 origin, vec3 direction, float tMin, float tMax, uint mask) {
    Hit hit;
    return walkScene(origin, direction, tMin, tMax, mask, true, hit);
}

#endif
