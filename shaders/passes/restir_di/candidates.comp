// ReSTIR DI, first pass: resampled importance sampling of this frame's candidates (Talbot 2005), and where last frame showed
// the same surface. Without reuse (TL_REUSE 0), and in frames that stand alone, it ends here, with the estimate.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/restir_di.h"

layout(push_constant, scalar) uniform Push { RestirPush push; };

#include "scene/light_tiles.glsl"
#include "scene/pass.glsl"
#include "scene/reservoir.glsl"

layout(TL_PIXEL_GROUP) in;

// The candidate kept so far. Each enters with w = pHat / sum over techniques t of M_t p_t, by solid angle: its
// balance-heuristic weight p_s / sum M_t p_t, times pHat / p_s. Here pHat is what choiceTarget makes of luminance(f L).
struct Stream {
    float sum;
    DirectSample kept;
    vec3 contribution; // f L
    float target;      // pHat
    float arrival;     // share of BSDF samples towards it that arrive; 0: a light sample
};

// `pdf`: of its light's samples; `bsdfDensity`: expected number of BSDF samples there. Both by solid angle.
void offer(inout Stream s, LightChoice choice, DirectSample d, vec3 contribution, float pdf, float bsdfDensity,
           float arrival, float u) {
    const float target = choiceTarget(choice, d.light, luminance(contribution), pdf);
    const float w = target / (choiceDensity(choice, d.light) * pdf + bsdfDensity);
    if (!(w > 0.0) || !isFinite(w) || !reservoirTakes(s.sum, w, u)) return;
    s.kept = d;
    s.contribution = contribution;
    s.target = target;
    s.arrival = arrival;
}

void offerLightSample(Shading shading, LightChoice choice, uint light, float bsdfSamples, inout Stream s,
                      inout Sampler rng) {
    const DirectSample d = sampleLight(shading.surface.position, light, sample2D(rng));
    const float u = sample1D(rng);
    if (!(d.pdfSolidAngle > 0.0)) return;
    float pdfBsdf;
    const vec3 f = evalBsdf(shading, d.wi, pdfBsdf);
    offer(s, choice, d, f * d.radiance, d.pdfSolidAngle, d.delta ? 0.0 : bsdfSamples * pdfBsdf, 0.0, u);
}

void offerSeen(Shading shading, LightChoice choice, uint light, vec2 uv, float pdf, float bsdfSamples, float opacity,
               inout Stream s, inout Sampler rng) {
    const DirectSample d = directSampleAt(shading.surface.position, light, uv);
    if (!(d.pdfSolidAngle > 0.0) || d.delta) return;
    float pdfBsdf;
    const vec3 f = evalBsdf(shading, d.wi, pdfBsdf);
    offer(s, choice, d, f * d.radiance, pdf, bsdfSamples * pdfBsdf, opacity, sample1D(rng));
}

void offerBsdfSample(Shading shading, LightChoice choice, float pSkipped, float bsdfSamples, inout Stream s, inout Sampler rng) {
    vec3 u = sample3D(rng);
    u.z = pSkipped + (1.0 - pSkipped) * u.z;
    const BsdfSample bounce = bsdfSample(shading.bsdf, shading.woLocal, min(u, vec3(kOneMinusEpsilon)));
    if ((bounce.flags & kBsdfValid) == 0u) return;
    const vec3 wi = shading.frame * bounce.wi;
    const Surface from = shading.surface;
    if (!crossesRightly(shading, wi, (bounce.flags & kBsdfTransmission) != 0u)) return;
    Hit hit;
    const vec3 origin = offsetRayOrigin(from.position, sideTowards(from, wi), from.extent);
    if (!traceSurface(origin, wi, 0.0, kFloatMax, kMaskIndirect, rng, hit)) {
        for (uint i = 0u; i < TL_SCENE.infiniteLightCount; ++i) {
            const Light light = TL_SCENE.lights.v[i];
            if (isBlack(lightRadiance(light, wi, lightUv(light, from.position, wi)))) continue;
            const float pdf = lightPdfSolidAngle(light, TL_SCENE.distributions, from.position, from.position, wi);
            offerSeen(shading, choice, i, infiniteLocalUv(light, wi), pdf, bsdfSamples, 1.0, s, rng);
        }
        return;
    }
    Surface emitter = loadSurface(hit);
    if (emitter.light == kNone || dot(emitter.geometricNormal, wi) >= 0.0) return;
    float opacity = 1.0;
#if TL_CUTOUTS
    opacity = hitOpacity(hit, emitter);
#endif
    const vec2 uv = lightUvOfHit(TL_SCENE.lights.v[emitter.light], hit);
    const float pdf = sampledLightPdf(from.position, emitter.light, emitter, wi);
    offerSeen(shading, choice, emitter.light, uv, pdf, bsdfSamples, opacity, s, rng);
}

// What is left of the kept candidate's light on its way; 1 for BSDF samples: they have been there.
float keptVisibility(Shading shading, inout Stream s) {
#if TL_CUTOUTS
    // A BSDF sample arrived by chance: the share that does divides its weight.
    const float share = lightVisibility(shading, s.kept);
    if (s.arrival > 0.0) s.sum = safeDivide(s.sum, share * s.arrival);
    return share;
#else
    return s.arrival > 0.0 ? 1.0 : lightVisibility(shading, s.kept);
#endif
}

// By this pixel's tile or, so that their borders don't show, one that is less than half a tile away.
LightChoice chooseLights(uvec2 pixel, inout Sampler rng) {
#if TL_CHOICE
    LightChoice choice = lightChoice(push.lightCandidates);
    if (push.learned == 0u) return choice;
    const ivec2 near = ivec2(pixel) + ivec2(floor((sample2D(rng) - 0.5) * float(kTileSide)));
    const uvec2 inside = uvec2(clamp(near, ivec2(0), ivec2(TL_FRAME.width, TL_FRAME.height) - 1));
    learnFrom(push.tiles.v[tileIndex(inside / kTileSide)], push.learnedCandidates, choice);
    choice.offset = sample1D(rng);
    return choice;
#else
    return lightChoice(push.lightCandidates);
#endif
}

Stream drawCandidates(uvec2 pixel, Shading shading, inout Sampler rng) {
    Stream s;
    s.sum = 0.0;
    s.contribution = vec3(0.0);
    s.arrival = 0.0;
    s.kept.light = kNone;
    if (!bsdfHasSmooth(shading.bsdf)) return s;
    // Densities of BSDF samples among the lobes that are no deltas: visibility stands for the others.
    const float pSkipped = bsdfDeltaProbability(shading.bsdf);
    const bool sharp = bsdfSharpestRoughness(shading.bsdf) <= push.bsdfRoughness;
    const uint count = sharp ? push.bsdfCandidates : 0u;
    const float bsdfSamples = float(count) / (1.0 - pSkipped);
    const LightChoice choice = chooseLights(pixel, rng);
    for (uint i = 0u; i < choice.samples; ++i) {
        const uint light = chooseLight(choice, i, rng);
        offerLightSample(shading, choice, light, bsdfSamples, s, rng);
    }
#if TL_BSDF_ROUGH || TL_BSDF_EVERYWHERE
    for (uint i = 0u; i < count; ++i) offerBsdfSample(shading, choice, pSkipped, bsdfSamples, s, rng);
#endif
    return s;
}

vec3 estimate(Stream s, float share) { return s.contribution * (s.sum / s.target) * share; }

#if TL_REUSE
Reservoir describe(VisiblePoint point, Shading shading) {
    Reservoir r = kEmptyReservoir;
    r.confidence = 1.0;
    r.normal = octahedralPack(shading.frame[2]);
    r.depth = point.footprint / TL_FRAME.camera.pixelAngle;
    return r;
}

// Returns the estimate, where visibility is known.
vec3 keepCandidate(Shading shading, Stream s, inout Reservoir r) {
    const bool looks = TL_UNBIASED != 0 || push.alone != 0u || (TL_CUTOUTS != 0 && s.arrival > 0.0);
    const float share = looks ? keptVisibility(shading, s) : 1.0;
    if (!(share > 0.0)) return vec3(0.0); // occluded: W = 0, the confidence stays
    const vec3 direct = estimate(s, share);
    const float perUv = directSampleAt(shading.surface.position, s.kept.light, s.kept.uv).pdfSolidAngle;
    if (!(perUv > 0.0)) return direct;
    r.light = s.kept.light;
    r.uv = s.kept.uv;
    r.target = luminance(s.contribution) / perUv;
    setWeight(r, s.sum / s.target * perUv);
    if (TL_UNBIASED != 0) r.target *= share;
    return direct;
}

TemporalNeighbor findNeighbor(uvec2 pixel, VisiblePoint point, Shading shading, Reservoir r) {
    TemporalNeighbor neighbor = TemporalNeighbor(kNone, 0.0);
    float depth = r.depth;
    if (push.history == 0u || !previousPixel(shading.surface, point.chain, pixel, depth)) return neighbor;
    const uint index = pixelIndex(pixel);
    const Reservoir before = push.previous.v[index];
    if (!isAlike(before, shading.frame[2], depth)) return neighbor;
    neighbor.pixel = index;
    if (before.weight > 0.0) {
        const uint light = currentLight(before.light);
        if (light != kNone) neighbor.target = lightTarget(shading, light, before.uv);
    }
    return neighbor;
}
#endif

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
#if TL_REUSE
    Reservoir r = kEmptyReservoir;
    TemporalNeighbor neighbor = TemporalNeighbor(kNone, 0.0);
#endif
    vec3 direct = vec3(0.0);
    ChosenLight chosen = ChosenLight(kNone, -1.0);
    if (point.instance != kNone) {
        Sampler rng = pixelSampler(pixel);
        rng.dimension = point.dimension;
        const Shading shading = shadeVisiblePoint(point);
        Stream s = drawCandidates(pixel, shading, rng);
#if TL_REUSE
        r = describe(point, shading);
        if (s.sum > 0.0) direct = keepCandidate(shading, s, r);
        if (push.alone == 0u) neighbor = findNeighbor(pixel, point, shading, r);
#else
        if (s.sum > 0.0) {
            const float share = keptVisibility(shading, s);
            direct = estimate(s, share);
        }
#endif
        chosen = ChosenLight(s.kept.light, luminance(direct));
        direct *= point.throughput;
    }
#if TL_REUSE
    if (push.alone != 0u) push.final.v[index] = r;
    else {
        push.merged.v[index] = r;
        push.neighbors.v[index] = neighbor;
    }
    if (push.alone != 0u)
#endif
    {
        push.direct.v[index] = direct;
#if TL_CHOICE
        push.chosen.v[index] = chosen;
#endif
    }
    countRays(rayCount);
}
