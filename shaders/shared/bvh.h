// The node of both levels of the compute tracer's BVH.
#ifndef TL_SHARED_BVH_H
#define TL_SHARED_BVH_H

#include "shared/types.h"

TL_BEGIN

// Binary; a node holds both children's boxes, so one fetch decides both. A child is inner when its count is 0: `index` is
// a node; else a leaf of `count` primitives from `index` on, in leaf order.
struct BvhNode {
    vec3 leftMin;
    uint leftIndex;
    vec3 leftMax;
    uint leftCount;
    vec3 rightMin;
    uint rightIndex;
    vec3 rightMax;
    uint rightCount;
};

TL_DECLARE_REF(BvhNode)

TL_END

#endif
