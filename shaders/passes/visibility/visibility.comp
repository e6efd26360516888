// Follows the camera ray through mirrors and glass to the first surface that is shaded, and collects the emission seen on
// the way: path class L S* E.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/visibility.h"

layout(push_constant, scalar) uniform Push { VisibilityPush push; };

#include "scene/camera.glsl"
#include "scene/pass.glsl"
#include "scene/shading.glsl"

layout(TL_PIXEL_GROUP) in;

struct Guides {
    vec3 albedo;
    vec3 normal;
    float depth;
    vec2 motion;
};

// Motion in pixels of what was at `before` last frame. Both through the pinhole, so that a still scene has none at all.
vec2 motionOf(vec3 place, vec3 before) {
    vec2 now;
    vec2 then;
    if (!projectToFilm(TL_FRAME.camera, place, now) || !projectToFilm(TL_FRAME.previousCamera, before, then)) return vec2(0.0);
    return (now - then) * vec2(TL_FRAME.width, TL_FRAME.height);
}

void guideBySurface(inout Guides guides, Surface s) {
    const vec3 fromCamera = s.position - TL_FRAME.camera.position;
    guides.normal = dot(s.shadingNormal, fromCamera) > 0.0 ? -s.shadingNormal : s.shadingNormal;
    guides.depth = dot(fromCamera, TL_FRAME.camera.forward);
    guides.motion = motionOf(s.position, s.previousPosition);
}

// The brightest emitter on the path, or its end: where it is seen now and was last frame, straight through mirrors and
// glass.
struct Sight {
    uint light;
    float brightness;
    vec3 place, before;
};

void see(inout Sight sight, uint light, vec3 radiance, vec3 place, vec3 before) {
    const float brightness = luminance(radiance);
    if (!(brightness >= sight.brightness)) return;
    sight = Sight(brightness > 0.0 ? light : kEmitterNone, brightness, place, before);
}

VisibleEmitter emitterOf(Sight sight, bool specular) {
    const bool changed = (TL_FRAME.flags & kFrameChanged) != 0u;
    return VisibleEmitter(sight.light | (specular ? kEmitterSpecular : 0u), changed ? motionOf(sight.place, sight.before) : vec2(0.0));
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);

    Sampler rng = pixelSampler(pixel);
    const vec2 film = (vec2(pixel) + sample2D(rng)) / vec2(TL_FRAME.width, TL_FRAME.height);
    const CameraRay camera = cameraRay(film, sample2D(rng));
    vec3 origin = camera.origin;
    vec3 direction = camera.direction;
    float tMin = camera.tMin;
    float tMax = camera.tMax;
    uint mask = kMaskCamera;

    VisiblePoint point;
    point.instance = kNone;
    point.throughput = vec3(1.0);
    vec3 emission = vec3(0.0);
    Guides guides = Guides(vec3(0.0), vec3(0.0), 0.0, vec2(0.0));
    float pathLength = 0.0;
    Sight sight = Sight(kEmitterNone, 0.0, vec3(0.0), vec3(0.0));
    bool mayTurn = false; // mirrors or glass on the path

    for (uint bounce = 0u;; ++bounce) {
        point.chain = bounce;
        Hit hit;
        if (!traceSurface(origin, direction, tMin, tMax, mask, rng, hit)) {
            const vec3 radiance = point.throughput * environmentRadiance(origin, direction, 0.0, false);
            emission += radiance;
            see(sight, kEmitterInfinite, radiance, TL_FRAME.camera.position + camera.direction,
                TL_FRAME.previousCamera.position + camera.direction);
            break;
        }
        pathLength += hit.t;
        const float footprint = pathLength * TL_FRAME.camera.pixelAngle;
        const Surface s = loadSurface(hit);
        if (bounce == 0u) guideBySurface(guides, s);
        const vec3 radiance = point.throughput * surfaceEmission(s, -direction, footprint);
        emission += radiance;
        const vec3 place = bounce == 0u ? s.position : camera.origin + pathLength * camera.direction;
        see(sight, min(s.light, kEmitterNone), radiance, place, bounce == 0u ? s.previousPosition : place);

        const Shading shading = prepareShading(s, -direction, footprint);
        const float pSpecular = bsdfDeltaProbability(shading.bsdf);
        bool specular = pSpecular > 0.0;
        vec3 u = vec3(0.0);
        if (specular) {
            mayTurn = true;
            u = sample3D(rng);
            specular = u.z < pSpecular;
        }
        if (!specular) {
            if (pSpecular >= 1.0) break;
            point.throughput /= 1.0 - pSpecular;
            point.instance = hit.instance;
            point.primitive = hit.primitive;
            point.uv = hit.uv;
            point.direction = direction;
            point.footprint = footprint;
            guides.albedo = point.throughput * bsdfAlbedo(shading.bsdf);
            break;
        }
        const BsdfSample bounceSample = bsdfSample(shading.bsdf, shading.woLocal, u);
        if ((bounceSample.flags & kBsdfValid) == 0u || bounce >= push.maxBounces) break;
        point.throughput *= bounceSample.weight;
        if (!(maxComponent(point.throughput) > 0.0)) break;
        direction = shading.frame * bounceSample.wi;
        if (!crossesRightly(shading, direction, (bounceSample.flags & kBsdfTransmission) != 0u)) break;
        origin = offsetRayOrigin(s.position, sideTowards(s, direction), s.extent);
        tMin = 0.0;
        tMax = kFloatMax;
        mask = kMaskIndirect;
    }
    point.dimension = rng.dimension;
    push.points.v[index] = point;
    push.emission.v[index] = emission;
    if ((push.flags & kVisibilityEmitters) != 0u) push.emitters.v[index] = emitterOf(sight, mayTurn);
    if ((push.flags & kVisibilityGuides) != 0u) {
        push.albedo.v[index] = guides.albedo;
        push.normal.v[index] = guides.normal;
        push.depth.v[index] = guides.depth;
        push.motion.v[index] = guides.motion;
    }
    countRays(rayCount);
}
