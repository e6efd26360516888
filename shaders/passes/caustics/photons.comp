// Photons: from a light, aimed at casters, through delta lobes to the first surface where the path takes another lobe.
// There each is splat to the pixel that sees it, kept for pixels that see it through mirrors and glass, and added to the
// cache. Path class L S+ D.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/guide.glsl"
#include "passes/caustics/grid.glsl"

#include "scene/camera_view.glsl"
#include "scene/caustic_cache.glsl"
#include "scene/emission.glsl"
#include "scene/shading.glsl"

layout(local_size_x = 64) in;

const uint kLongestChain = 64u; // mirrors and refractions; light beyond them is lost
const float kUnseen = 0.1;      // use of a photon that the camera doesn't see directly

struct Emission {
    vec3 point;     // on the light; infinite: outside the scene
    vec3 origin;    // of the ray
    vec3 direction; // unit
    vec3 flux;      // W, if one photon is emitted in all; 0: none
    bool parallel;  // from infinity
    uint group;     // of lights
};

// Mixture of the light's own emission and of aiming at casters; its density is that of the ray, whichever made it.
Emission emitPhoton(inout Sampler rng) {
    const uint index = lightSelect(TL_SCENE.lightAlias, TL_SCENE.lightCount, sampleBits(rng));
    const Light light = TL_SCENE.lights.v[index];
    const vec2 uPosition = sample2D(rng), uDirection = sample2D(rng), uCell = sample2D(rng);
    float uChoice = sample1D(rng);
    Emission e;
    e.group = guideGroup(index);
    e.parallel = lightIsInfinite(light);
    e.flux = vec3(0.0);

    const float share = TL_SCENE.casterCount > 0u ? push.uniformShare : 1.0;
    uint chosen = kNone;
    vec2 u = vec2(0.0);
    if (uChoice >= share) {
        const uint target = chooseTarget(e.group, (uChoice - share) / (1.0 - share));
        chosen = target / kGuideCells;
        u = pointInCell(target % kGuideCells, uCell);
    }
    EmitPoint start = EmitPoint(vec3(0.0), vec3(0.0), vec2(0.0), 0.0);
    if (!e.parallel) start = lightEmitPoint(light, TL_SCENE.distributions, uPosition);
    if (e.parallel || chosen == kNone) {
        e.direction = lightEmitDirection(light, TL_SCENE.distributions, start.normal, uDirection);
    } else {
        const Cone cone = casterCone(TL_SCENE.casters.v[chosen], start.position);
        e.direction = basisAround(cone.axis) * sampleCone(u, cone.oneMinusCos);
    }
    const float pdfLight = lightEmitPdfDirection(light, TL_SCENE.distributions, start.normal, e.direction);
    EmittedRay ray =
        emittedRay(light, start, e.direction, pdfLight, TL_SCENE.boundsCenter, TL_SCENE.boundsRadius, uPosition);
    if (e.parallel && chosen != kNone) {
        const Caster caster = TL_SCENE.casters.v[chosen];
        const vec2 across = caster.radius * sqrt(u.x) * vec2(cos(kTwoPi * u.y), sin(kTwoPi * u.y));
        const vec3 aim = caster.center + basisAround(e.direction) * vec3(across, 0.0);
        ray.origin = aim - e.direction * (dot(aim - TL_SCENE.boundsCenter, e.direction) + TL_SCENE.boundsRadius);
    }
    e.point = ray.origin;
    e.origin = emissionOrigin(light, ray);
    applyMaterialEmission(light, ray);

    float guided = 0.0;
    if (share < 1.0) guided = (1.0 - share) * guideDensity(e.group, e.point, e.direction, e.parallel, chosen);
    if (e.parallel) ray.pdfPosition = share * ray.pdfPosition + guided;
    else ray.pdfDirection = share * ray.pdfDirection + guided;
    const float pdf = light.selection * ray.pdfPosition * ray.pdfDirection;
    const float cosine = dot(ray.normal, e.direction);
    if (pdf > 0.0 && cosine > 0.0) e.flux = ray.radiance * (cosine / pdf);
    return e;
}

// Adds the photon to the pixel that sees it. Returns whether one does, or with kernels, whether one may.
bool splat(Shading shading, uint instance, vec3 flux, inout Sampler rng) {
    const CameraView view = viewFromCamera(shading.surface.position, sample2D(rng));
    if (!(view.distance > 0.0)) return false;
    if ((push.flags & kCausticsKernel) != 0u) return true;
    float pdfBsdf;
    const vec3 f = evalBsdf(shading, view.wi, pdfBsdf) * shadingNormalCorrection(shading, view.wi);
    // The pixel's mean radiance is an integral over directions from the lens with density pixels * pdfSolidAngle; by area
    // of the surface that density is times cos / distance^2, whose cosine evalBsdf holds.
    const float pixels = float(TL_FRAME.width) * float(TL_FRAME.height);
    const vec3 radiance = flux * f * (pixels * view.pdfSolidAngle / sqr(view.distance));
    if (!(maxComponent(radiance) > 0.0)) return false;
    const float visibility = visibilityToCamera(shading.surface, instance, view);
    if (visibility <= 0.0) return false;
    const uvec2 pixel = min(uvec2(view.film * vec2(TL_FRAME.width, TL_FRAME.height)),
                            uvec2(TL_FRAME.width, TL_FRAME.height) - 1u);
    addTo(push.splats, pixelIndex(pixel), radiance * visibility);
    countArrivals(1u);
    return true;
}

void addToCache(Surface s, uint instance, vec3 towardsLight, vec3 flux) {
    const CausticPlace place = causticPlace(instance, s.position, sideTowards(s, towardsLight));
    const uint slot = insertCausticPatch(push.cache, causticPatchHash(place));
    if (slot == kNone) return;
    addTo(push.cacheSums, slot, flux * place.inverseArea);
    atomicAdd(push.cacheCounts.v[slot], 1u);
}

void keepPhoton(uint photon, Surface s, vec3 towardsLight, vec3 flux) {
    const uint before = atomicExchange(push.heads.v[gatherHead(gatherCell(s.position))], photon);
    push.photons.v[photon] =
        Photon(s.position, octahedralPack(s.geometricNormal), flux, octahedralPack(towardsLight), before);
}

// Follows the photon to its end; returns its use for learning, W.
float tracePhoton(uint photon, Emission e, inout Sampler rng) {
    vec3 origin = e.origin, direction = e.direction, flux = e.flux;
    for (uint chain = 0u; chain <= kLongestChain; ++chain) {
        Hit hit;
        if (!traceSurface(origin, direction, 0.0, kFloatMax, kMaskIndirect, rng, hit)) return 0.0;
        const Surface s = loadSurface(hit);
        const float footprint = length(s.position - TL_FRAME.camera.position) * TL_FRAME.camera.pixelAngle;
        const Shading shading = prepareShading(s, -direction, footprint, kTransportImportance);
        const float pSpecular = bsdfDeltaProbability(shading.bsdf);
        const vec3 u = pSpecular > 0.0 ? sample3D(rng) : vec3(1.0);
        if (u.z >= pSpecular) {
            if (chain == 0u || !bsdfHasSmooth(shading.bsdf)) return 0.0;
            flux /= 1.0 - pSpecular;
            const float power = luminance(flux);
            flux /= float(push.state.v[0].emitted);
            addToCache(s, hit.instance, -direction, flux);
            keepPhoton(photon, s, -direction, flux);
            return splat(shading, hit.instance, flux, rng) ? power : kUnseen * power;
        }
        const BsdfSample bounce = bsdfSample(shading.bsdf, shading.woLocal, u);
        if ((bounce.flags & kBsdfValid) == 0u) return 0.0;
        direction = shading.frame * bounce.wi;
        if (!crossesRightly(shading, direction, (bounce.flags & kBsdfTransmission) != 0u)) return 0.0;
        flux *= bounce.weight * shadingNormalCorrection(shading, direction);
        if (!(maxComponent(flux) > 0.0)) return 0.0;
        origin = offsetRayOrigin(s.position, sideTowards(s, direction), s.extent);
    }
    return 0.0;
}

void main() {
    const uint photon = spreadGroup() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (photon >= push.state.v[0].emitted) return;
    push.photons.v[photon].flux = vec3(0.0);
    // One sequence of points over the photons of a frame, and another for each frame: what was learned from earlier frames
    // is independent of this one's points.
    const uint kind = (TL_FRAME.flags & kFrameSobol) != 0u ? kSamplerSobol : kSamplerIndependent;
    Sampler rng = samplerInit(uvec2(0xffffu), photon, pcg(TL_FRAME.frameIndex ^ pcg(TL_FRAME.seed)), kind);
    const Emission e = emitPhoton(rng);
    if (maxComponent(e.flux) > 0.0 && isFinite(e.flux)) {
        const float useful = tracePhoton(photon, e, rng);
        if (useful > 0.0)
            learnFlux(e.group, e.point, e.direction, e.parallel, useful / TL_SCENE.lightPower, sample1D(rng));
    }
    countRays(rayCount);
}
