// Light of two or more bounces by one ray of the BSDF a pixel, from the probes where it arrives: of all lobes (TL_FINAL 1, and
// where light goes through), or of rough reflections, in addition to what gather.comp has told of diffuse ones (TL_FINAL 0).
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeGatherPush push; };

#include "scene/pass.glsl"
#include "scene/rough.glsl"
#include "scene/visible_point.glsl"

layout(TL_PIXEL_GROUP) in;

// One ray of the lobes that are not deltas; at the first rough surface scattered light by a light sample and the probes.
vec3 gatherByRay(Shading shading, float footprint, inout Sampler rng) {
    // Delta lobes were the visibility node's.
    const float pSkipped = bsdfDeltaProbability(shading.bsdf);
    vec3 u = sample3D(rng);
    u.z = min(pSkipped + (1.0 - pSkipped) * u.z, kOneMinusEpsilon);
    const BsdfSample chosen = bsdfSample(shading.bsdf, shading.woLocal, u);
    if ((chosen.flags & kBsdfValid) == 0u || (chosen.flags & kBsdfDelta) != 0u) return vec3(0.0);
    const vec3 direction = shading.frame * chosen.wi;
    if (!crossesRightly(shading, direction, (chosen.flags & kBsdfTransmission) != 0u)) return vec3(0.0);
    const Surface s = shading.surface;
    const RoughHit hit =
        traceToRough(offsetRayOrigin(s.position, sideTowards(s, direction), s.extent), direction, footprint, rng);
    vec3 radiance = hit.passed;
    if (hit.found) {
        const ScatteredLight light = scatteredLight(push.volumes, push.causticCache, hit, rng);
        radiance += hit.throughput * (light.direct + light.caustic + light.probes);
    }
    return chosen.weight * (1.0 - pSkipped) * radiance;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
#if TL_FINAL
    if (pixel == uvec2(0u)) countProbes(push.volumes);
#endif
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
    vec3 indirect = TL_FINAL != 0 ? vec3(0.0) : push.indirect.v[index];
    if (point.instance != kNone) {
        Shading shading = shadeVisiblePoint(point);
#if !TL_FINAL
        if (!bsdfRefractsRoughly(shading.bsdf)) shading.bsdf = bsdfWithoutCosine(shading.bsdf);
#endif
        Sampler rng = pixelSampler(pixel);
        // Numbers of its own: those that follow the visible point's are the direct light's.
        rng.key = pcg(rng.key ^ 0x64646769u);
        if (bsdfHasSmooth(shading.bsdf)) indirect += point.throughput * gatherByRay(shading, point.footprint, rng);
    }
    push.indirect.v[index] = indirect;
    countRays(rayCount);
}
