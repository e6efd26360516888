// The node and the leaf of the compute tracer's BVH, for both levels.
#ifndef TL_SHARED_BVH_H
#define TL_SHARED_BVH_H

#include "shared/types.h"

TL_BEGIN

// Four children with boxes quantised to 8 bits inside the node's own box (after Ylitie, Karras, Laine 2017, with four
// children instead of eight): child c spans origin + scale * [low[c], high[c]] per axis, where scale = 2^(e - 127) and
// e is the axis' byte of `exponents`. Boxes only ever grow by the rounding. Unused children are empty leaves.
struct BvhNode {
    vec3 origin;
    uint exponents;   // bytes 0, 1, 2: biased exponents of x, y, z
    uint children[4]; // kBvhLeaf* below, or a node
    uint lowX;        // byte c: child c
    uint lowY;
    uint lowZ;
    uint highX;
    uint highY;
    uint highZ;
    uint padding0;
    uint padding1;
};

// A child with kBvhLeafBit holds the number of its primitives in the bits of kBvhLeafCountMask and the first one in
// those of kBvhLeafFirstMask; without, it is the index of a node, below kBvhNodeLimit.
TL_CONST uint kBvhLeafBit = 0x80000000u;
TL_CONST uint kBvhLeafCountShift = 27;
TL_CONST uint kBvhLeafCountMask = 0xfu;
TL_CONST uint kBvhLeafFirstMask = 0x07ffffffu;
TL_CONST uint kBvhEmpty = kBvhLeafBit;
TL_CONST uint kBvhNodeLimit = 1u << 24;

// Inner levels that the builder never exceeds, and the stack that follows: each level leaves at most one entry, and so
// do entering an instance and the end; one more is written before it is known whether it counts.
TL_CONST uint kBvhTopDepth = 12;
TL_CONST uint kBvhMeshDepth = 28;
TL_CONST uint kBvhStackSize = kBvhTopDepth + kBvhMeshDepth + 3;

// A triangle as the tracer reads it, in the order of the leaves.
struct LeafTriangle {
    vec3 corner0;
    vec3 corner1;
    vec3 corner2;
    uint triangle; // index in mesh order
};

TL_DECLARE_ALIGNED_REF(BvhNode, 16)
TL_DECLARE_ALIGNED_REF(LeafTriangle, 8)

TL_END

#endif
