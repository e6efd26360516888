// The compute tracer: a two-level BVH with quantised four-wide nodes in buffers, walked with one stack.
#ifndef TL_SCENE_TRACE_COMPUTE_GLSL
#define TL_SCENE_TRACE_COMPUTE_GLSL

#include "lib/intersect/shapes.glsl"
#include "lib/intersect/triangle.glsl"
#include "shared/scene.h"

// The stack's entries stand for what is left of a node: its index from bit 8, the number of children to visit in bits 6
// and 7, and their slots, two bits each, nearest first. One entry a node instead of one a child: where lanes are the lanes
// of a CPU's vectors, writing to the stack is what costs. An entry without children is a mark.
const uint kTraceLeave = 1; // back to the top level
const uint kTraceDone = 2;

uint markEntry(uint mark) { return mark << 8; }
uint entryNode(uint entry) { return entry >> 8; }
bool entryHasChildren(uint entry) { return (entry & 0xc0u) != 0; }
uint takeSlot(inout uint entry) {
    const uint slot = entry & 3;
    entry = ((entry & ~0x3fu) - 0x40u) | ((entry >> 2) & 0xfu);
    return slot;
}

// 1 / direction, with components near zero moved away from it, far below what single precision resolves in a position.
vec3 safeInverse(vec3 direction) {
    const vec3 d = abs(direction);
    const float least = 1e-12 * max(max(d.x, d.y), d.z);
    return mix(vec3(1), vec3(-1), lessThan(direction, vec3(0))) / max(d, vec3(least));
}

vec4 unpackBytes(uint word) {
    return vec4(word & 0xffu, (word >> 8) & 0xffu, (word >> 16) & 0xffu, word >> 24);
}

// Keys that sort the children by where the ray enters, with their slots in the lowest two bits; kTraceMiss and above where
// it misses them between tMin >= 0 and tMax.
const uint kTraceMiss = 0x7f800000u;
uvec4 intersectChildren(BvhNodeRef nodes, uint index, vec3 origin, vec3 inverse, float tMin, float tMax) {
    const uint exponents = nodes.v[index].exponents;
    const uint lowX = nodes.v[index].lowX, lowY = nodes.v[index].lowY, lowZ = nodes.v[index].lowZ;
    const uint highX = nodes.v[index].highX, highY = nodes.v[index].highY, highZ = nodes.v[index].highZ;
    // Plane q lies at t = q * slope + start. Both are rounded, relative to themselves, fewer than eight times: widening
    // every interval by that much keeps rays on the borders of boxes from falling through (Ize 2013).
    const vec3 slope = uintBitsToFloat((uvec3(exponents) << uvec3(23, 15, 7)) & 0x7f800000u) * inverse;
    const vec3 start = (nodes.v[index].origin - origin) * inverse;
    const vec3 slack = (abs(start) + 255.0 * abs(slope)) * 4.8e-7;
    const vec3 startNear = start - slack, startFar = start + slack;
    const bvec3 backward = lessThan(inverse, vec3(0));
    const uint nearX = backward.x ? highX : lowX, farX = backward.x ? lowX : highX;
    const uint nearY = backward.y ? highY : lowY, farY = backward.y ? lowY : highY;
    const uint nearZ = backward.z ? highZ : lowZ, farZ = backward.z ? lowZ : highZ;
    const vec4 enter = max(max(unpackBytes(nearX) * slope.x + startNear.x, unpackBytes(nearY) * slope.y + startNear.y),
                           max(unpackBytes(nearZ) * slope.z + startNear.z, vec4(tMin)));
    const vec4 leave = min(min(unpackBytes(farX) * slope.x + startFar.x, unpackBytes(farY) * slope.y + startFar.y),
                           min(unpackBytes(farZ) * slope.z + startFar.z, vec4(tMax)));
    const uvec4 key = (floatBitsToUint(enter) & ~3u) | uvec4(0, 1, 2, 3);
    return mix(uvec4(kTraceMiss), key, lessThanEqual(enter, leave));
}

void sortPair(inout uint near, inout uint far) {
    const uint nearest = min(near, far);
    far = max(near, far);
    near = nearest;
}

// Walks the scene; `anyHit` is constant at both calls, so that each gets its own code.
bool walkScene(vec3 worldOrigin, vec3 worldDirection, float tMin, float tMax, uint mask, const bool anyHit, out Hit hit) {
    hit = Hit(tMax, kNone, 0, vec2(0));
    if (!rayIsValid(worldOrigin, worldDirection, tMin, tMax)) return false;

    BvhNodeRef topNodes = TL_SCENE.topNodes;
    uintRef topInstances = TL_SCENE.topInstances;
    InstanceRef instances = TL_SCENE.instances;
    MeshRef meshes = TL_SCENE.meshes;

    uint stack[kBvhStackSize];
    stack[0] = markEntry(kTraceDone);
    uint height = 1;
    uint entry = 0; // the top of the stack

    const vec3 worldInverse = safeInverse(worldDirection);
    vec3 origin = worldOrigin;
    vec3 inverse = worldInverse;
    BvhNodeRef nodes = topNodes;
    LeafTriangleRef triangles;
    RayShear shear;
    uint instance = kNone; // none: at the top level
    uint next = 0;         // a child, or a mark as a leaf without primitives

    for (;;) {
        while (next < kBvhLeafBit) {
            uvec4 key = intersectChildren(nodes, next, origin, inverse, tMin, hit.t);
            sortPair(key.x, key.y);
            sortPair(key.z, key.w);
            sortPair(key.x, key.z);
            sortPair(key.y, key.w);
            sortPair(key.y, key.z);
            const uint others = uint(key.y < kTraceMiss) + uint(key.z < kTraceMiss) + uint(key.w < kTraceMiss);
            stack[height] = entry;
            if (others > 0) {
                height += uint(entryHasChildren(entry));
                entry = next << 8 | others << 6 | (key.w & 3) << 4 | (key.z & 3) << 2 | (key.y & 3);
            }
            uint slot = key.x & 3;
            bool isChild = true;
            if (key.x >= kTraceMiss) {
                if (!entryHasChildren(entry)) entry = stack[--height];
                isChild = entryHasChildren(entry);
                next = entryNode(entry);
                if (isChild) slot = takeSlot(entry);
            }
            next = isChild ? nodes.v[next].children[slot] : kBvhLeafBit | next;
        }
        if (next == (kBvhLeafBit | kTraceDone)) break;

        const uint first = next & kBvhLeafFirstMask;
        const uint count = (next >> kBvhLeafCountShift) & kBvhLeafCountMask;
        bool descends = false;
        if (count == 0) {
            if (first == kTraceLeave) {
                instance = kNone;
                nodes = topNodes;
                origin = worldOrigin;
                inverse = worldInverse;
            }
        } else if (instance == kNone) {
            const uint found = topInstances.v[first];
            if ((instances.v[found].mask & mask) != 0) {
                const mat4x3 localFromWorld = instances.v[found].localFromWorld;
                const vec3 localOrigin = localFromWorld * vec4(worldOrigin, 1);
                const vec3 localDirection = mat3(localFromWorld) * worldDirection;
                const uint shape = instances.v[found].shape;
                if (shape == kShapeMesh) {
                    const uint mesh = instances.v[found].mesh;
                    nodes = meshes.v[mesh].nodes;
                    triangles = meshes.v[mesh].leafTriangles;
                    origin = localOrigin;
                    inverse = safeInverse(localDirection);
                    shear = rayShear(localDirection);
                    instance = found;
                    stack[height] = entry;
                    height += uint(entryHasChildren(entry));
                    stack[height++] = markEntry(kTraceLeave);
                    entry = 0;
                    next = 0;
                    descends = true;
                } else {
                    const float t = intersectShape(shape, localOrigin, localDirection, tMin, hit.t);
                    if (t < hit.t) hit = Hit(t, found, 0, vec2(0));
                }
            }
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
        if (!descends) {
            if (!entryHasChildren(entry)) entry = stack[--height];
            const uint node = entryNode(entry);
            next = kBvhLeafBit | node;
            if (entryHasChildren(entry)) next = nodes.v[node].children[takeSlot(entry)];
        }
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
