// What a place on a light brings to a shaded surface, and the reservoirs of ReSTIR DI. TL_UNBIASED counts visibility in target
// functions.
#ifndef TL_SCENE_RESERVOIR_GLSL
#define TL_SCENE_RESERVOIR_GLSL

#include "lib/reservoir.glsl"
#include "scene/visible_point.glsl"
#include "shared/restir_di.h"

const Reservoir kEmptyReservoir = Reservoir(kNone, vec2(0.0), 0.0, 0.0, 0.0, 0u, 0.0);

// F = f L |d(solid angle) / duv|, W/(m^2 sr) per uv, without visibility. `d` tells how to get there.
vec3 lightContribution(Shading shading, uint light, vec2 uv, out DirectSample d) {
    d = directSampleAt(shading.surface.position, light, uv);
    if (!(d.pdfSolidAngle > 0.0)) return vec3(0.0);
    float pdfBsdf;
    return evalBsdf(shading, d.wi, pdfBsdf) * d.radiance / d.pdfSolidAngle;
}

float lightVisibility(Shading shading, DirectSample d) {
    return visibilityToLight(shading.surface, d.wi, d.distance, d.normal, d.extent);
}

// pHat = luminance(F), times visibility where TL_UNBIASED.
float lightTarget(Shading shading, uint light, vec2 uv) {
    DirectSample d;
    float target = luminance(lightContribution(shading, light, uv, d));
#if TL_UNBIASED
    if (target > 0.0) target *= lightVisibility(shading, d);
#endif
    return isFinite(target) ? target : 0.0;
}

// Whether a neighbour's visible point, described by its reservoir, is worth loading: like depth and orientation.
bool isAlike(Reservoir neighbor, vec3 normal, float depth) {
    return abs(neighbor.depth - depth) < 0.1 * depth && dot(octahedralUnpack(neighbor.normal), normal) > 0.5;
}

// A weight that is not finite is dropped and counted.
void setWeight(inout Reservoir r, float weight) {
    r.weight = weight;
    if (!isFinite(weight)) {
        r.weight = 0.0;
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
    }
}

// Ends resampling: W = sum of weights / pHat of what was kept.
void finishReservoir(inout Reservoir r, float sum) { setWeight(r, r.target > 0.0 ? sum / r.target : 0.0); }

// Random numbers that decide on reuse must not know of the ones before: a sequence that fills its square evenly from frame to
// frame would couple what is drawn now with how the reservoirs came about, and bias the weights.
const uint kReuseTemporal = 0x10000u; // first dimensions, beyond those of candidates
const uint kReuseSpatial = 0x20000u;
Sampler reuseSampler(uvec2 pixel, uint firstDimension) {
    Sampler rng = samplerInit(pixel, TL_FRAME.frameIndex, TL_FRAME.seed, kSamplerIndependent);
    rng.dimension = firstDimension;
    return rng;
}

#endif
