// Passes along one axis. A thread walks kChain pixels, `spacing` apart, and one more at either end: what surfaces have in
// common is found once for a pair, and a pixel is loaded 1.5 times rather than 3.
#ifndef TL_DENOISE_CHAIN_GLSL
#define TL_DENOISE_CHAIN_GLSL

#include "passes/denoise/common.glsl"

layout(TL_PIXEL_GROUP) in;

const int kChain = int(kDenoiseChain);

// k from -1 to kChain.
ivec2 chainPixel(int k) {
    const ivec2 thread = ivec2(gl_GlobalInvocationID.xy);
    const int along = push.axis == 0u ? thread.x : thread.y;
    const int place = along / push.spacing * push.spacing * kChain + along % push.spacing + k * push.spacing;
    return push.axis == 0u ? ivec2(place, thread.y) : ivec2(thread.x, place);
}

// A pixel's surface, as its neighbours see it.
struct Link {
    uint index;
    bool inside; // the view; else another pixel is loaded for it
    vec3 position, normal;
    uint behindSpecular;
};

Link linkAt(ivec2 pixel) {
    const uint index = pixelIndex(clamp(pixel, ivec2(0), ivec2(TL_FRAME.width, TL_FRAME.height) - 1));
    const uint normal = push.surfaces.v[index].normal;
    return Link(index, insideView(pixel), push.surfaces.v[index].position, octahedralUnpack(normal), normal & 1u);
}

// The mean share of the squared offset from each other's plane in the squared distance. Free of scale.
float offPlane(Link p, Link q) {
    const vec3 apart = q.position - p.position;
    const float distance2 = lengthSquared(apart);
    const float off2 = 0.5 * (sqr(dot(p.normal, apart)) + sqr(dot(q.normal, apart)));
    return distance2 > 0.0 ? off2 / distance2 : 0.0;
}

float cosineBetween(Link p, Link q) {
    return p.inside && q.inside && p.behindSpecular == q.behindSpecular ? saturate(dot(p.normal, q.normal)) : 0.0;
}

float pow4(float x) { return sqr(sqr(x)); }

#endif
