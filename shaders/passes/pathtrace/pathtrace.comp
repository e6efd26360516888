// Unidirectional path tracing from the visible point, with next-event estimation and multiple importance sampling by the
// power heuristic (Veach 1997, ch. 9). Without NEE (TL_NEE 0) as in the paper: lights are found by BSDF samples alone.
// Unbiased: no depth limit in effect, Russian roulette by throughput.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/passes.h"

layout(push_constant, scalar) uniform Push { PathtracePush push; };

#include "scene/pass.glsl"
#include "scene/shading.glsl"
#include "scene/visible_point.glsl"

layout(TL_PIXEL_GROUP) in;

// Radiance by path class; the path so far decides where light found at its end belongs.
struct Signals {
    vec3 direct;
    vec3 caustic;
    vec3 indirect;
};

void addSignal(inout Signals signals, uint roughSurfaces, bool specularSince, vec3 radiance) {
    if (roughSurfaces > 1u) signals.indirect += radiance;
    else if (specularSince) signals.caustic += radiance;
    else signals.direct += radiance;
}

Signals tracePath(VisiblePoint point, inout Sampler rng) {
    Signals signals = Signals(vec3(0.0), vec3(0.0), vec3(0.0));
    vec3 throughput = point.throughput;
    Shading shading = shadeVisiblePoint(point);
    float footprint = point.footprint;
    // The visibility node has stood for this surface's delta lobes already: here they have no share.
    float pSkipped = bsdfDeltaProbability(shading.bsdf);
    uint roughSurfaces = 0u;
    bool specularSince = false;

    for (uint depth = 0u; depth < push.maxDepth; ++depth) {
#if TL_NEE
        if (TL_SCENE.lightCount > 0u && bsdfHasSmooth(shading.bsdf))
            addSignal(signals, roughSurfaces + 1u, false, throughput * sampledDirectLight(shading, true, rng));
#endif
        vec3 u = sample3D(rng);
        u.z = pSkipped + (1.0 - pSkipped) * u.z;
        BsdfSample bounce = bsdfSample(shading.bsdf, shading.woLocal, min(u, vec3(kOneMinusEpsilon)));
        if ((bounce.flags & kBsdfValid) == 0u) break;
        throughput *= bounce.weight * (1.0 - pSkipped);
        pSkipped = 0.0;
        const vec3 direction = shading.frame * bounce.wi;
        if (!crossesRightly(shading, direction, (bounce.flags & kBsdfTransmission) != 0u)) break;
        const bool specular = (bounce.flags & kBsdfDelta) != 0u;
        if (!specular) ++roughSurfaces;
        specularSince = specular;

        if (depth >= push.rouletteDepth) {
            const float survival = min(maxComponent(throughput), 0.95);
            if (!(sample1D(rng) < survival)) break;
            throughput /= survival;
        } else if (!(maxComponent(throughput) > 0.0)) break;

        const Surface from = shading.surface;
        const vec3 origin = offsetRayOrigin(from.position, sideTowards(from, direction), from.extent);
        const bool weighted = TL_NEE != 0 && !specular;
        Hit hit;
        if (!traceSurface(origin, direction, 0.0, kFloatMax, kMaskIndirect, rng, hit)) {
            addSignal(signals, roughSurfaces, specularSince,
                      throughput * environmentRadiance(from.position, direction, bounce.pdfSolidAngle, weighted));
            break;
        }
        footprint += hit.t * TL_FRAME.camera.pixelAngle;
        const Surface s = loadSurface(hit);
        const vec3 emission = surfaceEmission(s, -direction, footprint);
        if (maxComponent(emission) > 0.0) {
            const float weight =
                weighted ? powerHeuristic(bounce.pdfSolidAngle, directPdfSolidAngle(from.position, s, direction)) : 1.0;
            addSignal(signals, roughSurfaces, specularSince, throughput * emission * weight);
        }
        shading = prepareShading(s, -direction, footprint);
    }
    return signals;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
    Signals signals = Signals(vec3(0.0), vec3(0.0), vec3(0.0));
    if (point.instance != kNone) {
        Sampler rng = pixelSampler(pixel);
        rng.dimension = point.dimension;
        signals = tracePath(point, rng);
    }
    push.direct.v[index] = signals.direct;
    push.caustic.v[index] = signals.caustic;
    push.indirect.v[index] = signals.indirect;
    countRays(rayCount);
}
