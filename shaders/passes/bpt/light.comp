// Light subpaths, one for each pixel. Each rough vertex is connected to the camera (t = 1) and kept for eye subpaths.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/bpt.h"

layout(push_constant, scalar) uniform Push { BptPush push; };

#include "passes/bpt/common.glsl"
#include "scene/camera_view.glsl"
#if TL_BPT_RESERVOIRS
#include "scene/reservoir.glsl"
#endif

layout(TL_PIXEL_GROUP) in;

// A particle on its way.
struct Particle {
    vec3 direction;
    vec3 flux;      // W
    MisState mis;
    uint rough;     // surfaces that scattered it by a lobe other than a delta
    uint depth;     // surfaces met
};

void addSplat(uint pixel, uint pathClass, vec3 radiance) {
    if (TL_BPT_DIRECT == 0 && pathClass == kBptDirect) return; // restir_di's
    if (!fixedAtomicAdd(push.splats, splatWord(pixel, pathClass), radiance / splatUnit()))
        atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
}

uint splatClass(Particle p) {
    if (p.rough > 0u) return kBptIndirect;
    return p.depth > 1u ? kBptCaustic : kBptDirect;
}

// t = 1: the vertex seen by the camera.
void connectToCamera(Particle p, Surface s, uint instance, float cosIn, inout Sampler rng) {
    const CameraView view = viewFromCamera(s.position, sample2D(rng));
    if (!(view.distance > 0.0)) return;
    const Shading shading = prepareShading(s, view.wi, view.distance * TL_FRAME.camera.pixelAngle);
    const float pStop = 1.0 - bsdfDeltaProbability(shading.bsdf);
    float pdfReverse;
    const vec3 f = evalBsdf(shading, -p.direction, pdfReverse);
    if (!(pStop > 0.0) || !(maxComponent(f) > 0.0)) return;
    const float pdfCamera = view.pdfSolidAngle * cosGeometric(s, view.wi) / sqr(view.distance);
    const float wLight = misPower(pStop * pdfCamera) * strategiesBehind(p.mis, pdfReverse / pStop);
    vec3 radiance = p.flux * f * (pdfCamera / (cosIn * (1.0 + wLight)));
    if (!(maxComponent(radiance) > 0.0)) return;
    radiance *= visibilityToCamera(s, instance, view);
    if (!(maxComponent(radiance) > 0.0)) return;
    const uvec2 size = uvec2(TL_FRAME.width, TL_FRAME.height);
    addSplat(pixelIndex(min(uvec2(view.film * vec2(size)), size - 1u)), splatClass(p), radiance);
}

// Of a subpath with more vertices than fit, each is as likely to stay (Vitter 1985, algorithm R).
void keepVertex(uint pixel, uint number, BptVertex vertex, inout Sampler rng) {
    uint slot = number;
    if (number >= push.maxVertices) slot = min(uint(sample1D(rng) * float(number + 1u)), number);
    if (slot < push.maxVertices) push.vertices.v[pixel * push.maxVertices + slot] = vertex;
}

// On to the next direction; false where the particle ends.
bool scatterParticle(inout Particle p, Shading shading, float cosIn, float brightness, inout Sampler rng) {
    const Surface s = shading.surface;
    const vec3 wi = shading.wo;
    const BsdfSample bounce = bsdfSample(shading.bsdf, shading.woLocal, sample3D(rng));
    if ((bounce.flags & kBsdfValid) == 0u) return false;
    p.direction = shading.frame * bounce.wi;
    if (!crossesRightly(shading, p.direction, (bounce.flags & kBsdfTransmission) != 0u)) return false;
    const float cosOut = cosGeometric(s, p.direction);
    const bool specular = (bounce.flags & kBsdfDelta) != 0u;
    // The eye's BSDF f(wo, wi) |cos(wi)| with the roles that the eye sees, so that both subpaths carry the same function
    // though shading normals break its symmetry (Veach 1997, 5.3): radiance needs |cos(wi)| to the shading normal, the
    // density of particles |cos| to the geometric one.
    float pdfReverse = 0.0;
    vec3 weight;
    if (specular) {
        if (!specularReverses(shading, p.direction, 0.0)) return false;
        weight = bounce.weight * shadingNormalCorrection(shading, p.direction);
    } else {
        weight = evalBsdf(prepareShading(s, p.direction, 0.0), wi, pdfReverse) * (cosOut / (cosIn * bounce.pdfSolidAngle));
        ++p.rough;
    }
    p.flux *= weight;
    p.mis = misScatter(p.mis, specular, bounce.pdfSolidAngle, pdfReverse, cosOut);

    if (p.depth > push.rouletteDepth) {
        const float survival = min(maxComponent(p.flux) / brightness, 0.95);
        if (!(sample1D(rng) < survival)) return false;
        p.flux /= survival;
    }
    return maxComponent(p.flux) > 0.0;
}

// Where a light subpath starts: a ray of a light, and the flux that it stands for.
struct Start {
    uint light;
    EmittedRay ray;
    vec3 flux;
};

vec3 rayFlux(EmittedRay ray, float weight) {
    return ray.radiance * max(safeDivide(dot(ray.normal, ray.direction) * weight, ray.pdfPosition * ray.pdfDirection), 0.0);
}

// A light by its power, and a ray of it.
Start startByPower(inout Sampler rng) {
    Start s;
    s.light = lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, sampleBits(rng));
    const Light light = TL_SCENE.lights.v[s.light];
    s.ray = sampleEmission(light, rng);
    s.flux = rayFlux(s.ray, (TL_FRAME.flags & kFrameUncompensated) != 0u ? 1.0 : 1.0 / light.selection);
    return s;
}

#if TL_BPT_RESERVOIRS
// The place on a light that the pixel's reservoir holds; its unbiased contribution weight stands for 1 / pdf.
Start startByReservoir(Reservoir r, Shading shading, inout Sampler rng) {
    Start s;
    s.light = r.weight > 0.0 ? r.light : 0u;
    s.ray = sampleEmissionAt(TL_SCENE.lights.v[s.light], r.uv, rng);
#if TL_CUTOUTS
    // The weight counts the share of light that gets to the visible point.
    r.weight = safeDivide(r.weight, lightVisibility(shading, directSampleAt(shading.surface.position, s.light, r.uv)));
#endif
    s.flux = rayFlux(s.ray, r.weight);
    return s;
}

// Reservoirs know the places only that have a target, which light the visible point; all others must come from starts by
// power, or their light is lost, as in the paper. So a share of starts is by power: these weigh 1 where the reservoir
// reaches too, and 1 / share elsewhere; with the reservoir's, which weigh 1, that is 1 in all everywhere.
Start startParticle(uint pixel, inout Sampler rng) {
    const VisiblePoint point = push.points.v[pixel];
    const bool byPower = sample1D(rng) < push.powerShare;
    if (point.instance == kNone) return startByPower(rng);
    const Shading shading = shadeVisiblePoint(point);
    if (!byPower) return startByReservoir(push.reservoirs.v[pixel], shading, rng);
    Start s = startByPower(rng);
    if (!(lightTarget(shading, s.light, emissionLocalUv(TL_SCENE.lights.v[s.light], s.ray)) > 0.0)) s.flux /= push.powerShare;
    return s;
}
#else
Start startParticle(uint pixel, inout Sampler rng) { return startByPower(rng); }
#endif

// Returns how many vertices could be connected to.
uint traceParticle(uint pixel, inout Sampler rng) {
    const Start start = startParticle(pixel, rng);
    const EmittedRay ray = start.ray;
    const Light light = TL_SCENE.lights.v[start.light];
    const float pdfEmit = emissionPdf(light, ray.origin, ray.normal, ray.direction);
    const float cosLight = dot(ray.normal, ray.direction);
    if (!(pdfEmit > 0.0 && cosLight > 0.0)) return 0u;

    Particle p;
    p.direction = ray.direction;
    p.flux = start.flux;
    p.rough = p.depth = 0u;
    const float brightness = maxComponent(p.flux);
    vec3 origin = emissionOrigin(light, ray);
    uint number = 0u;

    while (p.depth < push.maxDepth && maxComponent(p.flux) > 0.0) {
        Hit hit;
        if (!traceSurface(origin, p.direction, 0.0, kFloatMax, kMaskIndirect, rng, hit)) break;
        const Surface s = loadSurface(hit);
        const float cosIn = cosGeometric(s, p.direction);
        if (!(cosIn > 0.0)) break;
        if (p.depth++ == 0u) {
            const float pdfLight = light.selection * (ray.delta ? 1.0
                                                                : lightPdfSolidAngle(light, TL_SCENE.distributions,
                                                                                     s.position, ray.origin, -p.direction));
            const float a = cosLight / (pdfEmit * cosIn);
            p.mis = MisState(misPower(pdfLight * a), ray.delta ? 0.0 : misPower(a));
        } else {
            p.mis = misArrive(p.mis, hit.t, cosIn);
        }
        const Shading shading = prepareShading(s, -p.direction, 0.0, kTransportImportance);
        if (bsdfHasSmooth(shading.bsdf)) {
            connectToCamera(p, s, hit.instance, cosIn, rng);
            keepVertex(pixel, number++,
                       BptVertex(hit.instance, hit.primitive, hit.uv, -p.direction, p.flux / cosIn, p.mis.dVCM, p.mis.dVC),
                       rng);
        }
        if (!scatterParticle(p, shading, cosIn, brightness, rng)) break;
        origin = offsetRayOrigin(s.position, sideTowards(s, p.direction), s.extent);
    }
    return number;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    Sampler rng = pixelSampler(pixel);
    rng.key = pcg(rng.key ^ 0x6c696768u); // numbers of its own, beside the eye subpath's
    const uint index = pixelIndex(pixel);
    push.vertexCounts.v[index] = traceParticle(index, rng);
    countRays(rayCount);
}
