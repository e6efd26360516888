// ReSTIR DI, last pass: merges the reservoirs of pixels around, keeps the result for the next frame, and shades with it.
// Path class L D S* E.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/restir_di.h"

layout(push_constant, scalar) uniform Push { RestirPush push; };

#include "scene/pass.glsl"
#include "scene/reservoir.glsl"

layout(TL_PIXEL_GROUP) in;

const uint kMaxNeighbors = 8u;

// Pixels around whose visible points are alike; returns their number.
uint findNeighbors(uvec2 pixel, Reservoir r, out uint neighbors[kMaxNeighbors], out float confidence, inout Sampler rng) {
    const vec3 normal = octahedralUnpack(r.normal);
    uint count = 0u;
    confidence = 0.0;
    for (uint i = 0u; i < min(push.spatialNeighbors, kMaxNeighbors); ++i) {
        const ivec2 at = ivec2(pixel) + ivec2(round(push.radius * sampleDisk(sample2D(rng))));
        if (any(lessThan(at, ivec2(0))) || !insideView(uvec2(at)) || at == ivec2(pixel)) continue;
        const uint index = pixelIndex(uvec2(at));
        const Reservoir neighbor = push.merged.v[index];
        if (!isAlike(neighbor, normal, r.depth)) continue;
        neighbors[count++] = index;
        confidence += neighbor.confidence;
    }
    return count;
}

Reservoir merge(Shading shading, Reservoir canonical, uvec2 pixel, inout Sampler rng) {
    uint neighbors[kMaxNeighbors];
    float confidence;
    const uint count = findNeighbors(pixel, canonical, neighbors, confidence, rng);
    const float c = canonical.confidence;

    Reservoir r = canonical;
    r.target = 0.0;
    r.confidence = c + confidence;
    float sum = 0.0;
    float mCanonical = c / (c + confidence);
    for (uint i = 0u; i < count; ++i) {
        const Reservoir n = push.merged.v[neighbors[i]];
        if (n.weight > 0.0) {
            const float target = lightTarget(shading, n.light, n.uv);
            const float w = pairwiseNeighbor(c, confidence, n.confidence, target, n.target) * target * n.weight;
            if (w > 0.0 && reservoirTakes(sum, w, sample1D(rng))) {
                r.light = n.light;
                r.uv = n.uv;
                r.target = target;
            }
        }
        if (canonical.weight > 0.0) {
            const Shading there = shadeVisiblePoint(push.points.v[neighbors[i]]);
            const float target = lightTarget(there, canonical.light, canonical.uv);
            mCanonical += pairwiseCanonical(c, confidence, n.confidence, canonical.target, target);
        }
    }
    const float w = mCanonical * canonical.target * canonical.weight;
    if (w > 0.0 && reservoirTakes(sum, w, sample1D(rng))) {
        r.light = canonical.light;
        r.uv = canonical.uv;
        r.target = canonical.target;
    }
    finishReservoir(r, sum);
    return r;
}

// F W V. Where targets count visibility, the reservoir's holds it.
vec3 shade(Shading shading, inout Reservoir r) {
    if (!(r.weight > 0.0)) return vec3(0.0);
    DirectSample d;
    const vec3 contribution = lightContribution(shading, r.light, r.uv, d);
#if TL_UNBIASED
    return contribution * (safeDivide(r.target, luminance(contribution)) * r.weight);
#else
    const float share = lightVisibility(shading, d);
    if (!(share > 0.0)) r.weight = 0.0; // the next frame reuses what this ray saw
    return contribution * (share * r.weight);
#endif
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    Reservoir r = push.merged.v[index];
    vec3 direct = vec3(0.0);
    ChosenLight chosen = ChosenLight(kNone, -1.0);
    if (r.depth > 0.0) {
        const VisiblePoint point = push.points.v[index];
        const Shading shading = shadeVisiblePoint(point);
        Sampler rng = reuseSampler(pixel, kReuseSpatial);
        r = merge(shading, r, pixel, rng);
        direct = shade(shading, r);
        chosen = ChosenLight(r.light, luminance(direct));
        direct *= point.throughput;
    }
    push.final.v[index] = r;
    push.direct.v[index] = direct;
#if TL_CHOICE
    push.chosen.v[index] = chosen;
#endif
    countRays(rayCount);
}
