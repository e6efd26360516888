// ReSTIR DI, second pass: merges last frame's reservoir into this frame's. Runs in last frame's scene (TL_LAST_FRAME): its
// lights, surfaces and acceleration structures tell whether the candidate could have been last frame's too.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/restir_di.h"

layout(push_constant, scalar) uniform Push { RestirPush push; };

#include "scene/pass.glsl"
#include "scene/previous.glsl"
#include "scene/reservoir.glsl"

layout(TL_PIXEL_GROUP) in;

// What the candidate's target was at last frame's visible point.
float targetBefore(Reservoir candidate, uint pixel) {
    const uint light = previousLight(candidate.light);
    if (light == kNone) return 0.0;
    return lightTarget(shadeVisiblePoint(push.previousPoints.v[pixel]), light, candidate.uv);
}

Reservoir merge(Reservoir candidate, TemporalNeighbor neighbor, float u) {
    const Reservoir before = push.previous.v[neighbor.pixel];
    const float c = candidate.confidence;
    const float cBefore = min(before.confidence, push.maxHistory * c);

    float sum = 0.0;
    if (candidate.weight > 0.0) {
        const float pBefore = targetBefore(candidate, neighbor.pixel);
        const float m = c / (c + cBefore) + pairwiseCanonical(c, cBefore, cBefore, candidate.target, pBefore);
        sum = m * candidate.target * candidate.weight;
    }
    const float m = pairwiseNeighbor(c, cBefore, cBefore, neighbor.target, before.target);
    const float w = m * neighbor.target * before.weight;
    Reservoir r = candidate;
    r.confidence = c + cBefore;
    if (w > 0.0 && reservoirTakes(sum, w, u)) {
        r.light = currentLight(before.light);
        r.uv = before.uv;
        r.target = neighbor.target;
    }
    finishReservoir(r, sum);
    return r;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const TemporalNeighbor neighbor = push.neighbors.v[index];
    if (neighbor.pixel != kNone) {
        Sampler rng = reuseSampler(pixel, kReuseTemporal);
        push.merged.v[index] = merge(push.merged.v[index], neighbor, sample1D(rng));
    }
    countRays(rayCount);
}
