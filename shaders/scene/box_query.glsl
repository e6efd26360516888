// Whether a box holds anything. Only our own BVH can tell: ray queries answer for rays alone.
#ifndef TL_SCENE_BOX_QUERY_GLSL
#define TL_SCENE_BOX_QUERY_GLSL

#include "scene/trace.glsl"

// bool boxIsEmpty(vec3 center, vec3 extent, uint mask)
//   True: no surface of an instance whose mask shares a bit with `mask` comes closer to the center than `extent` along all
//   axes, but for rounding. False: one may.

#ifdef TL_TRACER_QUERY

const bool kBoxesAnswer = false;

bool boxIsEmpty(vec3 center, vec3 extent, uint mask) { return false; }

#else

#include "lib/intersect/box.glsl"

const bool kBoxesAnswer = true;

// What is left to visit of a node: its index from bit 4, and a bit for each child whose box the given one meets.
uint childrenInBox(BvhNodeRef nodes, uint index, vec3 low, vec3 high) {
    const uint exponents = nodes.v[index].exponents;
    const vec3 scale = uintBitsToFloat((uvec3(exponents) << uvec3(23, 15, 7)) & 0x7f800000u);
    const vec3 from = low - nodes.v[index].origin, to = high - nodes.v[index].origin;
    const vec4 below = max(max(unpackBytes(nodes.v[index].lowX) * scale.x - to.x,
                               unpackBytes(nodes.v[index].lowY) * scale.y - to.y),
                           unpackBytes(nodes.v[index].lowZ) * scale.z - to.z);
    const vec4 above = max(max(from.x - unpackBytes(nodes.v[index].highX) * scale.x,
                               from.y - unpackBytes(nodes.v[index].highY) * scale.y),
                           from.z - unpackBytes(nodes.v[index].highZ) * scale.z);
    const uvec4 meets = uvec4(lessThanEqual(max(below, above), vec4(0))) << uvec4(0, 1, 2, 3);
    return index << 4 | meets.x | meets.y | meets.z | meets.w;
}

bool boxIsEmpty(vec3 center, vec3 extent, uint mask) {
    const Parallelepiped worldBox =
        parallelepiped(center, mat3(extent.x, 0, 0, 0, extent.y, 0, 0, 0, extent.z));
    BvhNodeRef topNodes = TL_SCENE.topNodes;
    Parallelepiped box = worldBox;
    BvhNodeRef nodes = topNodes;
    LeafTriangleRef triangles;
    uint stack[kBvhStackSize];
    uint height = 0;
    uint entered = kNone; // the height at which an instance's own nodes begin; none: at the top level
    uint entry = childrenInBox(nodes, 0, box.center - box.extent, box.center + box.extent);
    for (;;) {
        if ((entry & 0xfu) == 0) {
            if (height == 0) return true;
            if (height == entered) {
                entered = kNone;
                nodes = topNodes;
                box = worldBox;
            }
            entry = stack[--height];
            continue;
        }
        uint next = nodes.v[entry >> 4].children[findLSB(entry)];
        entry &= entry - 1;
        const uint first = next & kBvhLeafFirstMask;
        const uint count = (next >> kBvhLeafCountShift) & kBvhLeafCountMask;
        bool descends = next < kBvhLeafBit;
        if (!descends && entered != kNone) {
            for (uint i = first; i < first + count; ++i) {
                const LeafTriangle triangle = triangles.v[i];
                if (mayMeetTriangle(box, triangle.corner0, triangle.corner1, triangle.corner2)) return false;
            }
        } else if (!descends && count > 0) {
            const uint found = TL_SCENE.topInstances.v[first];
            if ((TL_SCENE.instances.v[found].mask & mask) == 0) continue;
            const Parallelepiped local = transformed(TL_SCENE.instances.v[found].localFromWorld, worldBox);
            const uint shape = TL_SCENE.instances.v[found].shape;
            if (shape != kShapeMesh) {
                if (mayMeetShape(local, shape)) return false;
                continue;
            }
            const uint mesh = TL_SCENE.instances.v[found].mesh;
            box = local;
            nodes = TL_SCENE.meshes.v[mesh].nodes;
            triangles = TL_SCENE.meshes.v[mesh].leafTriangles;
            entered = height + 1;
            next = 0;
            descends = true;
        }
        if (descends) {
            stack[height++] = entry;
            entry = childrenInBox(nodes, next, box.center - box.extent, box.center + box.extent);
        }
    }
}

#endif
#endif
