// One half of a level of an edge-avoiding a-trous transform (Dammertz 2010; guided by variance: Schied 2017), along one
// axis and in the form of an exchange between pixels: what one gains the other loses, so the sum of radiance is kept
// exactly. On a uniform surface the levels are means of 3, 9 and 27 pixels.
// TL_LAST puts albedo back; a channel without albedo keeps the history's mean: there was nothing to divide by.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseFilterPush push; };

#include "passes/denoise/chain.glsl"

const float kNever = 1e3;

// What a pixel reflects, and what it has gained of its neighbours so far.
struct Albedo {
    vec3 value, inverse;
    float luminanceInverse;
};
struct Exchange {
    vec4 own;         // estimate and variance
    float brightness; // luminance under the surface's own albedo
    vec3 gained;      // radiance
    float lost;       // share of its own brightness
    float variance;   // of what it has gained
};

Albedo albedoAt(uint index) {
    const vec3 albedo = push.surfaces.v[index].albedo;
    return Albedo(albedo, perAlbedo(albedo), safeDivide(1.0, luminance(albedo)));
}

Exchange exchangeAt(uint signal, uint index, Albedo albedo) {
    const vec4 own = push.from[signal].v[index];
    return Exchange(own, luminance(albedo.value * own.rgb) * albedo.luminanceInverse, vec3(0.0), 0.0, 0.0);
}

// `weight` and `exponent` of the two surfaces, `limit` the lesser albedo, which limits the exchange of radiance.
void trade(inout Exchange p, inout Exchange q, float weight, float exponent, vec3 limit, float shareP, float shareQ) {
    const float difference2 = sqr(p.brightness - q.brightness);
    const float noise = sqr(push.sigma) * (p.own.w + q.own.w);
    if (difference2 > 0.0) exponent -= min(0.5 * difference2 / noise, kNever); // also where noise is 0
    const float share = weight * exp(exponent);
    const vec3 flow = share * limit * (q.own.rgb - p.own.rgb);
    p.gained += flow;
    q.gained -= flow;
    p.lost += share * shareP;
    q.lost += share * shareQ;
    p.variance += sqr(share * shareP) * q.own.w;
    q.variance += sqr(share * shareQ) * p.own.w;
}

void finish(uint signal, uint index, Exchange e, Albedo albedo) {
    const vec3 estimate = e.own.rgb + e.gained * albedo.inverse;
#if TL_LAST
    vec3 radiance = albedo.value * estimate;
    for (int i = 0; i < 3; ++i)
        if (!(albedo.value[i] > 0.0)) radiance[i] = push.histories[signal].v[index].mean[i];
    push.signals[signal].v[index] = radiance;
#else
    push.to[signal].v[index] = vec4(estimate, e.variance + sqr(1.0 - e.lost) * e.own.w);
#endif
}

void main() {
    if (!insideView(chainPixel(0))) return;
    Link last = linkAt(chainPixel(-1));
    Albedo lastAlbedo = albedoAt(last.index);
    Exchange lasts[TL_SIGNALS];
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) lasts[s] = exchangeAt(s, last.index, lastAlbedo);
    [[unroll]] for (int k = 0; k <= kChain; ++k) {
        const Link link = linkAt(chainPixel(k));
        const Albedo albedo = albedoAt(link.index);
        // A third of (n . n)^64 exp(-s^2 / 0.1^2) to each side.
        const float weight = 1.0 / 3.0 * pow4(pow4(pow4(cosineBetween(last, link))));
        const float exponent = -100.0 * offPlane(last, link);
        const vec3 limit = min(lastAlbedo.value, albedo.value);
        const float shareLast = luminance(limit) * lastAlbedo.luminanceInverse;
        const float share = luminance(limit) * albedo.luminanceInverse;
        [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
            Exchange exchange = exchangeAt(s, link.index, albedo);
            trade(lasts[s], exchange, weight, exponent, limit, shareLast, share);
            if (k > 0 && last.inside) finish(s, last.index, lasts[s], lastAlbedo);
            lasts[s] = exchange;
        }
        last = link;
        lastAlbedo = albedo;
    }
}
