// Each pixel's vector and those of its two neighbours on like surfaces, summed. The includer says which are alike and what
// becomes of the sums.
#ifndef TL_DENOISE_SUM_GLSL
#define TL_DENOISE_SUM_GLSL

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseSumPush push; };

#include "passes/denoise/chain.glsl"

void finish(uint signal, uint index, vec4 sums);

bool alike(Link p, Link q) {
#if TL_CHANGES
    return pow4(cosineBetween(p, q)) * exp(-offPlane(p, q) / sqr(0.4)) > 0.5;
#else
    return sqr(pow4(pow4(cosineBetween(p, q)))) * exp(-offPlane(p, q) / sqr(0.1)) > 0.5;
#endif
}

void main() {
    if (!insideView(chainPixel(0))) return;
    Link last = linkAt(chainPixel(-1));
    vec4 lastOwn[TL_SIGNALS];
    vec4 lastSums[TL_SIGNALS];
    [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) lastOwn[s] = push.from[s].v[last.index];
    [[unroll]] for (int k = 0; k <= kChain; ++k) {
        const Link link = linkAt(chainPixel(k));
        const float share = alike(last, link) ? 1.0 : 0.0;
        [[unroll]] for (uint s = 0u; s < TL_SIGNALS; ++s) {
            const vec4 own = push.from[s].v[link.index];
            if (k > 0 && last.inside) finish(s, last.index, lastSums[s] + share * own);
            lastSums[s] = own + share * lastOwn[s];
            lastOwn[s] = own;
        }
        last = link;
    }
}

#endif
