// Each pixel's vector and those of its two neighbours on like surfaces, summed. The includer says which are alike and what
// becomes of the sums.
#ifndef TL_DENOISE_SUM_GLSL
#define TL_DENOISE_SUM_GLSL

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseSumPush push; };

#ifndef TL_FROM_HISTORY // rather than sums
#define TL_FROM_HISTORY 0
#endif

#include "passes/denoise/chain.glsl"

void finish(uint signal, uint index, vec4 sums);

bool alike(Link p, Link q) {
#if TL_CHANGES
    return pow4(cosineBetween(p, q)) * exp(-offPlane(p, q) / sqr(0.4)) > 0.5;
#else
    return pow4(pow4(pow4(cosineBetween(p, q)))) * exp(-offPlane(p, q) / sqr(0.1)) > 0.5;
#endif
}

// What is summed: pixels (1 or 0), luminance without albedo, its square, its variance; or the difference of these.
void ownAt(uint index, out vec4 own[TL_SIGNALS]) {
#if TL_FROM_HISTORY
    const float perLuminance = safeDivide(1.0, luminance(push.surfaces.v[index].albedo));
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
        const DenoiseHistory h = push.histories[s].v[index];
        const float value = luminance(h.mean) * perLuminance;
        const float variance = safeDivide(frameVariance(h), h.frames) * sqr(perLuminance);
        own[s] = vec4(perLuminance > 0.0 ? 1.0 : 0.0, value, sqr(value), variance);
    }
#else
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) own[s] = push.from[s].v[index];
#endif
}

void main() {
    if (!insideView(chainPixel(0))) return;
    Link last = linkAt(chainPixel(-1));
    vec4 lastOwn[TL_SIGNALS];
    vec4 lastSums[TL_SIGNALS];
    ownAt(last.index, lastOwn);
    [[unroll]] for (int k = 0; k <= kChain; ++k) {
        const Link link = linkAt(chainPixel(k));
        const float share = alike(last, link) ? 1.0 : 0.0;
        vec4 own[TL_SIGNALS];
        ownAt(link.index, own);
        [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
            if (k > 0 && last.inside) finish(s, last.index, lastSums[s] + share * own[s]);
            lastSums[s] = own[s] + share * lastOwn[s];
        }
        lastOwn = own;
        last = link;
    }
}

#endif
