// One level of an edge-avoiding a-trous transform (Dammertz 2010; guided by variance: Schied 2017), in the form of an
// exchange between pixels: what one gains the other loses, so the sum of radiance is kept exactly.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseFilterPush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Luminance under the surface's own albedo.
float brightness(vec3 estimate, vec3 albedo) { return safeDivide(luminance(albedo * estimate), luminance(albedo)); }

// What a pixel has gained of its neighbours so far.
struct Exchange {
    vec4 own; // estimate and variance
    float brightness;
    vec3 gained;
    float kept;
    float variance;
};

// `weight`: of the two surfaces; `limit`: the lesser albedo, which limits the exchange of radiance, over one's own.
void trade(inout Exchange e, vec4 other, float weight, vec3 limit, vec3 ownAlbedo, vec3 otherAlbedo) {
    const float difference = e.brightness - brightness(other.rgb, otherAlbedo);
    const float noise = sqr(push.sigma) * (e.own.w + other.w);
    if (difference != 0.0) weight *= noise > 0.0 ? exp(-0.5 * sqr(difference) / noise) : 0.0;
    if (!(weight > 0.0)) return;
    const vec3 share = weight * limit;
    e.gained += share * (other.rgb - e.own.rgb);
    const float meanShare = brightness(share, ownAlbedo);
    e.kept -= meanShare;
    e.variance += sqr(meanShare) * other.w;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const DenoiseSurface p = push.surfaces.v[index];

    Exchange exchanges[TL_SIGNALS];
    [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k) {
        const vec4 own = push.from[k].v[index];
        exchanges[k] = Exchange(own, brightness(own.rgb, p.albedo), vec3(0.0), 1.0, 0.0);
    }
    for (int i = 0; i < 9; ++i) {
        const ivec2 offset = ivec2(i % 3 - 1, i / 3 - 1);
        const ivec2 tap = ivec2(pixel) + push.spacing * offset;
        if (offset == ivec2(0) || !insideView(tap)) continue;
        const uint tapIndex = pixelIndex(tap);
        const DenoiseSurface q = push.surfaces.v[tapIndex];
        const float weight = (offset.x == 0 || offset.y == 0 ? 0.125 : 0.0625) * likeness(p, q);
        if (!(weight > 0.0)) continue;
        const vec3 limit = withoutAlbedo(min(p.albedo, q.albedo), p.albedo);
        [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k)
            trade(exchanges[k], push.from[k].v[tapIndex], weight, limit, p.albedo, q.albedo);
    }
    [[unroll]] for (uint k = 0u; k < TL_SIGNALS; ++k) {
        const Exchange e = exchanges[k];
        push.to[k].v[index] = vec4(e.own.rgb + e.gained, e.variance + sqr(e.kept) * e.own.w);
    }
}
