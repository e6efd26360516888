// What each pixel shades, and where in the last frame the same surface stood.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseSurfacesPush push; };

#include "passes/denoise/common.glsl"
#include "scene/camera.glsl"
#include "scene/visible_point.glsl"

layout(TL_PIXEL_GROUP) in;

const float kSameNormal = 0.9;
const float kSamePlane = 2.0; // footprints

struct Past {
    ivec2 corner;
    vec4 weights;
    bool samePixel; // the pixel itself, unmoved: its mean albedo goes on as its mean radiance does
};

DenoiseSurface surfaceOf(VisiblePoint point, out vec3 before) {
    DenoiseSurface now = DenoiseSurface(vec3(0.0), 0u, vec3(0.0), 1.0, kNone);
    before = vec3(0.0);
    if (point.instance == kNone) return now;
    const Shading shading = shadeVisiblePoint(point);
    const vec3 albedo = point.throughput * bsdfAlbedo(shading.bsdf);
    now.position = shading.surface.position;
    now.normal = packNormal(shading.frame[2], point.chain > 0u);
    now.albedo = isFinite(albedo) ? max(albedo, vec3(0.0)) : vec3(0.0);
    now.chain = point.chain;
    before = (push.flags & kDenoiseStill) != 0u ? shading.surface.position : shading.surface.previousPosition;
    return now;
}

// Distance between where the surface should have been and what the pixel showed; above `reach`: something else.
float mismatch(ivec2 pixel, DenoiseSurface now, vec3 before, float reach) {
    if (!insideView(pixel)) return kFloatMax;
    const DenoiseSurface then = push.previous.v[pixelIndex(pixel)];
    const vec3 normal = octahedralUnpack(now.normal);
    if (then.chain != now.chain || dot(normal, octahedralUnpack(then.normal)) < kSameNormal) return kFloatMax;
    // What a lens or mirror shows slides over its plane when the mirror moves: there the point itself must be the same.
    const vec3 apart = then.position - before;
    const float distance = now.chain > 0u ? length(apart) : abs(dot(normal, apart));
    return distance <= reach ? distance : kFloatMax;
}

Past reproject(ivec2 pixel, DenoiseSurface now, vec3 before, float footprint) {
    Past past = Past(pixel, vec4(0.0), false);
    if (now.chain == kNone) return past;
    const float reach = kSamePlane * footprint;
    vec2 motion = vec2(0.0);
    if ((push.flags & kDenoiseCameraStill) == 0u || before != now.position) {
        // What a mirror shows moves otherwise than its surface does.
        if (now.chain > 0u) return past;
        vec2 filmNow;
        vec2 filmBefore;
        if (!projectToFilm(TL_FRAME.camera, now.position, filmNow) ||
            !projectToFilm(TL_FRAME.previousCamera, before, filmBefore))
            return past;
        motion = (filmNow - filmBefore) * vec2(TL_FRAME.width, TL_FRAME.height);
    }
    // Also keeps the corner in 16 bits.
    if (any(greaterThan(abs(motion), vec2(TL_FRAME.width, TL_FRAME.height)))) return past;

    const vec2 from = vec2(pixel) - motion;
    past.corner = ivec2(floor(from));
    const vec2 f = from - vec2(past.corner);
    const vec4 bilinear = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    for (int i = 0; i < 4; ++i)
        if (bilinear[i] > 0.0 && mismatch(past.corner + ivec2(i & 1, i >> 1), now, before, reach) <= reach)
            past.weights[i] = bilinear[i];
    past.samePixel = motion == vec2(0.0);
    if (dot(past.weights, vec4(1.0)) > 0.01) return past;

    // At an edge the sample may have fallen on the other side: a neighbour then knows the surface.
    past = Past(pixel, vec4(0.0), false);
    float best = kFloatMax;
    for (int i = 0; i < 9; ++i) {
        const ivec2 tap = ivec2(round(from)) + ivec2(i % 3 - 1, i / 3 - 1);
        const float distance = mismatch(tap, now, before, reach);
        if (!(distance < best)) continue;
        best = distance;
        past.corner = tap;
        past.weights.x = 1.0;
    }
    return past;
}

// Whether the pixel's path, which found no surface, may find the last frame's again: mirrors and glass, or the pixel's edge,
// sent it elsewhere. Only the place of its sample and its choices are known to be new.
bool strayed(VisiblePoint point, uint index) {
    if (point.instance != kNone || (push.flags & kDenoiseHistory) == 0u) return false;
    const uint chain = push.previous.v[index].chain;
    if ((push.flags & kDenoiseStill) != 0u) return chain != kNone;
    return (push.flags & kDenoiseCameraStill) != 0u && point.chain > 0u && chain != kNone && chain > 0u;
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
    vec3 before;
    DenoiseSurface now = surfaceOf(point, before);

    Past past = Past(ivec2(pixel), vec4(0.0), false);
    const bool stray = strayed(point, index);
    if (stray) {
        const DenoiseSurface then = push.previous.v[index];
        now.position = then.position;
        now.normal = then.normal;
        now.chain = then.chain;
    }
    if ((push.flags & kDenoiseHistory) != 0u) {
        // Nothing moved: what differs from the last frame is the place of the sample within the pixel.
        if (stray || (push.flags & kDenoiseStill) != 0u) past = Past(ivec2(pixel), vec4(1.0, 0.0, 0.0, 0.0), true);
        else past = reproject(ivec2(pixel), now, before, point.footprint);
    }

    DenoiseReprojection reprojection = DenoiseReprojection(0u, 0u, vec3(1.0));
    const float total = dot(past.weights, vec4(1.0));
    if (total > 0.0) {
        past.weights /= total;
        vec3 albedo = vec3(0.0);
        float frames = 0.0;
        for (int i = 0; i < 4; ++i) {
            if (past.weights[i] == 0.0) continue;
            const DenoiseSurface then = push.previous.v[pixelIndex(past.corner + ivec2(i & 1, i >> 1))];
            albedo += past.weights[i] * then.albedo;
            frames += past.weights[i] * then.frames;
        }
        now.frames = min(frames + 1.0, push.maxFrames);
        if (past.samePixel) {
            now.albedo = mix(albedo, now.albedo, 1.0 / now.frames);
        } else {
            for (int i = 0; i < 3; ++i)
                if (albedo[i] > 0.0) reprojection.gain[i] = now.albedo[i] / albedo[i];
        }
        reprojection.corner = uint(past.corner.x + 1) | uint(past.corner.y + 1) << 16;
        reprojection.weights = packUnorm4x8(past.weights);
    }
    push.surfaces.v[index] = now;
    if ((push.flags & kDenoiseStill) == 0u) push.reprojection.v[index] = reprojection;
}
