// Eye subpaths from the visible points: emitters met by chance (s = 0), one light sample (s = 1) and connections to the
// stored vertices of the pixel's light subpath (s > 1) at each rough vertex. Adds the splats of the light pass (t = 1).
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/bpt.h"

layout(push_constant, scalar) uniform Push { BptPush push; };

#include "passes/bpt/common.glsl"

layout(TL_PIXEL_GROUP) in;

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

// A rough vertex of the eye subpath.
struct EyeVertex {
    Shading shading;
    float footprint;
    MisState mis;
    float pStop; // q of common.glsl; 1 after the visible point
};

// What an eye vertex is joined to: the light's sampled point or a vertex of the light subpath.
struct Joint {
    vec3 wi;       // unit, from the eye vertex
    float distance;
    vec3 normal;   // unit, on the side of the eye vertex
    float extent;  // for ray offsets
    vec3 radiance; // arriving along wi, over its density by solid angle
    float light;   // wLight = light * pdf^b of sampling wi at the eye vertex
    float eye;     // wEye = eye * cos^b at the eye vertex * the strategies behind it
};

Joint joinLight(vec3 position, inout Sampler rng) {
    const DirectSample d = sampleDirect(position, rng);
    Joint j = Joint(d.wi, d.distance, d.normal, d.extent, vec3(0.0), 0.0, 0.0);
    if (!(d.pdfSolidAngle > 0.0)) return j;
    const float pdf = (TL_FRAME.flags & kFrameUncompensated) != 0u ? uncompensatedPdf(d) : d.pdfSolidAngle;
    const Light light = TL_SCENE.lights.v[d.light];
    j.radiance = d.radiance / pdf;
    if (!d.delta) j.light = misPower(1.0 / d.pdfSolidAngle);
    const float pdfEmit = emissionPdf(light, position + d.distance * d.wi, d.normal, -d.wi);
    j.eye = misPower(safeDivide(pdfEmit, d.pdfSolidAngle * -dot(d.normal, d.wi)));
    return j;
}

Joint joinVertex(vec3 position, BptVertex v, float weight) {
    const Surface s = loadSurface(Hit(0.0, v.instance, v.primitive, v.uv));
    const vec3 toVertex = s.position - position;
    const float distance = length(toVertex);
    Joint j = Joint(toVertex / distance, distance, vec3(0.0), s.extent, vec3(0.0), 0.0, 0.0);
    if (!(distance > 0.0)) return j;
    const vec3 wo = -j.wi;
    j.normal = sideTowards(s, wo);
    float pdfReverse;
    const vec3 f = evalBsdf(prepareShading(s, wo, 0.0), v.direction, pdfReverse);
    const float geometry = cosGeometric(s, wo) / (distance * distance);
    j.radiance = v.flux * f * (weight * geometry);
    j.light = misPower(geometry) * strategiesBehind(MisState(v.dVCM, v.dVC), pdfReverse);
    j.eye = misPower(scatterPdf(s, v.direction, wo, 0.0) / (distance * distance));
    return j;
}

vec3 joined(EyeVertex z, Joint j) {
    if (!(maxComponent(j.radiance) > 0.0)) return vec3(0.0);
    const Surface s = z.shading.surface;
    float pdf;
    const vec3 f = evalBsdf(z.shading, j.wi, pdf);
    vec3 radiance = j.radiance * f;
    if (!(maxComponent(radiance) > 0.0)) return vec3(0.0);
    const float pdfReverse = z.mis.dVC > 0.0 ? scatterPdf(s, j.wi, z.shading.wo, z.footprint) : 0.0;
    const float wLight = misPower(pdf / z.pStop) * j.light;
    const float wEye = misPower(cosGeometric(s, j.wi)) * j.eye * strategiesBehind(z.mis, pdfReverse);
    radiance *= 1.0 / (1.0 + wLight + wEye);
    if (!(maxComponent(radiance) > 0.0)) return vec3(0.0);
    return radiance * visibilityToLight(s, j.wi, j.distance, j.normal, j.extent);
}

// s = 0: weight of emission met along `direction` from the vertex at `from`, by the light's densities there; `mis` is that
// of the light's point, or of the last vertex for lights at infinity.
float emitterWeight(Light light, MisState mis, vec3 from, vec3 point, vec3 normal, vec3 direction, float cosOverSquare) {
    const float pdfLight = light.selection * lightPdfSolidAngle(light, TL_SCENE.distributions, from, point, direction);
    const float pdfEmit = emissionPdf(light, point, normal, -direction);
    return 1.0 / (1.0 + misPower(pdfLight * cosOverSquare) * mis.dVCM + misPower(pdfEmit) * mis.dVC);
}

vec3 emittersAtInfinity(MisState mis, vec3 from, vec3 direction) {
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < TL_SCENE.infiniteLightCount; ++i) {
        const Light light = TL_SCENE.lights.v[i];
        const vec3 radiance = lightRadiance(light, direction, lightUv(light, from, direction));
        if (maxComponent(radiance) > 0.0)
            sum += radiance * emitterWeight(light, mis, from, from, -direction, direction, 1.0);
    }
    return sum;
}

vec3 emitterMet(MisState mis, vec3 from, Surface s, vec3 direction, float distance, float footprint) {
    const vec3 radiance = surfaceEmission(s, -direction, footprint);
    if (!(maxComponent(radiance) > 0.0) || s.light == kNone) return radiance;
    const Light light = TL_SCENE.lights.v[s.light];
    return radiance * emitterWeight(light, mis, from, s.position, s.geometricNormal, direction,
                                    cosGeometric(s, direction) / (distance * distance));
}

// The visible point's distance along its ray from the lens, whose plane goes through the camera.
MisState misAtVisiblePoint(VisiblePoint point, Surface s, float pStop) {
    const Camera camera = TL_FRAME.camera;
    const float cosAxis = dot(point.direction, camera.forward);
    const float cosIn = cosGeometric(s, point.direction);
    if (point.chain > 0u || !(cosIn > 0.0)) return MisState(0.0, 0.0);
    const float distance = dot(s.position - camera.position, camera.forward) / cosAxis;
    return MisState(misPower(camera.filmArea * cosAxis * cosAxis * cosAxis * sqr(distance) / (pStop * cosIn)), 0.0);
}

Signals tracePath(uint pixel, VisiblePoint point, inout Sampler rng) {
    Signals signals = Signals(vec3(0.0), vec3(0.0), vec3(0.0));
    vec3 throughput = point.throughput;
    EyeVertex z;
    z.shading = shadeVisiblePoint(point);
    z.footprint = point.footprint;
    // The visibility node has stood for this surface's delta lobes already: here they have no share.
    z.pStop = 1.0 - bsdfDeltaProbability(z.shading.bsdf);
    z.mis = misAtVisiblePoint(point, z.shading.surface, z.pStop);
    uint roughSurfaces = 0u;
    const uint vertexCount = push.vertexCounts.v[pixel];
    const uint stored = min(vertexCount, push.maxVertices);
    const float vertexWeight = float(vertexCount) / float(max(stored, 1u));

    for (uint depth = 0u; depth < push.maxDepth; ++depth) {
        const Surface from = z.shading.surface;
        if (bsdfHasSmooth(z.shading.bsdf)) {
            // The last joint is with a light: direct light at the visible point, which may be restir_di's.
            const uint joints = TL_BPT_DIRECT == 0 && depth == 0u ? stored : stored + 1u;
            for (uint i = 0u; i < joints; ++i) {
                Joint j;
                if (i == stored) j = joinLight(from.position, rng);
                else j = joinVertex(from.position, push.vertices.v[pixel * push.maxVertices + i], vertexWeight);
                // A vertex of a light subpath is one more rough surface.
                addSignal(signals, roughSurfaces + (i == stored ? 1u : 2u), false, throughput * joined(z, j));
            }
        }
        vec3 u = sample3D(rng);
        u.z = (1.0 - z.pStop) + z.pStop * u.z;
        const BsdfSample bounce = bsdfSample(z.shading.bsdf, z.shading.woLocal, min(u, vec3(kOneMinusEpsilon)));
        if ((bounce.flags & kBsdfValid) == 0u) break;
        const vec3 direction = z.shading.frame * bounce.wi;
        if (!crossesRightly(z.shading, direction, (bounce.flags & kBsdfTransmission) != 0u)) break;
        throughput *= bounce.weight * z.pStop;
        const bool specular = (bounce.flags & kBsdfDelta) != 0u;
        if (!specular) ++roughSurfaces;

        float pdfReverse = 0.0;
        if (z.mis.dVC > 0.0) {
            if (!specular) pdfReverse = scatterPdf(from, direction, z.shading.wo, z.footprint);
            else if (!specularReverses(z.shading, direction, z.footprint)) z.mis.dVC = 0.0;
        }
        z.mis = misScatter(z.mis, specular, bounce.pdfSolidAngle / z.pStop, pdfReverse, cosGeometric(from, direction));
        z.pStop = 1.0;

        if (depth >= push.rouletteDepth) {
            const float survival = min(maxComponent(throughput), 0.95);
            if (!(sample1D(rng) < survival)) break;
            throughput /= survival;
        } else if (!(maxComponent(throughput) > 0.0)) break;

        const vec3 origin = offsetRayOrigin(from.position, sideTowards(from, direction), from.extent);
        Hit hit;
        if (!traceSurface(origin, direction, 0.0, kFloatMax, kMaskIndirect, rng, hit)) {
            addSignal(signals, roughSurfaces, specular, throughput * emittersAtInfinity(z.mis, from.position, direction));
            break;
        }
        z.footprint += hit.t * TL_FRAME.camera.pixelAngle;
        const Surface s = loadSurface(hit);
        const float cosIn = cosGeometric(s, direction);
        if (!(cosIn > 0.0)) break;
        z.mis = misArrive(z.mis, hit.t, cosIn);
        addSignal(signals, roughSurfaces, specular,
                  throughput * emitterMet(z.mis, from.position, s, direction, hit.t, z.footprint));
        z.shading = prepareShading(s, -direction, z.footprint);
    }
    return signals;
}

vec3 splatted(uint pixel, uint pathClass) {
    return fixedColor(push.splats, splatWord(pixel, pathClass)) * splatUnit();
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
        signals = tracePath(index, point, rng);
    }
#if TL_BPT_DIRECT
    push.direct.v[index] = signals.direct + splatted(index, kBptDirect);
#endif
    push.caustic.v[index] = signals.caustic + splatted(index, kBptCaustic);
    push.indirect.v[index] = signals.indirect + splatted(index, kBptIndirect);
    countRays(rayCount);
}
