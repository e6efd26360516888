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

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const DenoiseSurface p = push.surfaces.v[index];
    const vec4 own = push.from.v[index];
    const float ownBrightness = brightness(own.rgb, p.albedo);

    vec3 gained = vec3(0.0);
    float kept = 1.0;
    float variance = 0.0;
    for (int i = 0; i < 9; ++i) {
        const ivec2 offset = ivec2(i % 3 - 1, i / 3 - 1);
        const ivec2 tap = ivec2(pixel) + push.spacing * offset;
        if (offset == ivec2(0) || !insideView(tap)) continue;
        const uint tapIndex = pixelIndex(tap);
        const DenoiseSurface q = push.surfaces.v[tapIndex];
        const vec4 other = push.from.v[tapIndex];
        const float difference = ownBrightness - brightness(other.rgb, q.albedo);
        const float noise = sqr(push.sigma) * (own.w + other.w);
        float weight = offset.x == 0 || offset.y == 0 ? 0.125 : 0.0625;
        weight *= likeness(p, q);
        if (difference != 0.0) weight *= noise > 0.0 ? exp(-0.5 * sqr(difference) / noise) : 0.0;
        if (!(weight > 0.0)) continue;
        // The lesser albedo limits the exchange of radiance between the two.
        const vec3 share = weight * withoutAlbedo(min(p.albedo, q.albedo), p.albedo);
        gained += share * (other.rgb - own.rgb);
        const float meanShare = brightness(share, p.albedo);
        kept -= meanShare;
        variance += sqr(meanShare) * other.w;
    }
    push.to.v[index] = vec4(own.rgb + gained, variance + sqr(kept) * own.w);
}
