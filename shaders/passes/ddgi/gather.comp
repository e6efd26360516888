// Light of two or more bounces that visible points reflect diffusely, from the probes there.
//
// While light and things stand still each pixel is looked up in one of kLookupTurns frames; in the others it keeps what it
// was told: a sample of the same pixel as good as a new one. Not what mirrors and glass show, whose noise should not last.
// When the camera moves, a pixel keeps what the one was told that showed its surface, of the same triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeGatherPush push; };

#include "scene/camera.glsl"
#include "scene/pass.glsl"
#include "scene/rough.glsl"
#include "scene/visible_point.glsl"

layout(TL_PIXEL_GROUP) in;

// Pixels to look up, each subgroup's together: thread + group size * turn.
shared uint waiting[kLookupTurns * gl_WorkGroupSize.x * gl_WorkGroupSize.y];

// Pixel `turn` of a thread's. Neighbours have different turns: squares of one age would show.
uvec2 ownPixel(uint thread, uint turn) {
    const uvec2 first = gl_WorkGroupID.xy * gl_WorkGroupSize.xy + uvec2(thread % gl_WorkGroupSize.x, thread / gl_WorkGroupSize.x);
    return first * uvec2(kLookupColumns, kLookupRows) + uvec2(turn % kLookupColumns, turn / kLookupColumns);
}

// Which pixel a thread has to look up. Were it as regular while the camera moves, some surfaces would never have their turn.
uint turnOf(uint thread) {
    if (push.moved == 0u) return push.turn;
    return pcg(TL_FRAME.frameIndex ^ pcg(pixelIndex(ownPixel(thread, 0u)))) % kLookupTurns;
}

// Whether a point is of the triangle that the pixel showed, without mirrors and glass, when it was looked up.
bool isKnown(VisiblePoint point, ProbeLookup lookup) {
    return point.instance != kNone && point.chain == 0u && point.instance == lookup.instance && point.primitive == lookup.primitive;
}

// What was told about the surface that a pixel shows.
ProbeLookup lookupBefore(uvec2 pixel, VisiblePoint point) {
    if (push.moved == 0u) return push.before.v[pixelIndex(pixel)];
    const vec3 position = TL_FRAME.camera.position + point.footprint / TL_FRAME.camera.pixelAngle * point.direction;
    const vec2 size = vec2(TL_FRAME.width, TL_FRAME.height);
    vec2 film;
    const bool seen = projectToFilm(TL_FRAME.previousCamera, position, film);
    const vec2 place = floor(film * size);
    if (!seen || any(lessThan(place, vec2(0.0))) || any(greaterThanEqual(place, size))) return ProbeLookup(vec3(0.0), kNone, 0u);
    return push.before.v[pixelIndex(uvec2(place))];
}

void main() {
    const uint threads = gl_WorkGroupSize.x * gl_WorkGroupSize.y;
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    const uint first = kLookupTurns * gl_SubgroupID * gl_SubgroupSize;
    const uint turn = turnOf(thread);
    if (gl_GlobalInvocationID.xy == uvec2(0u)) countProbes(push.volumes);
    uint count = 0u;
    for (uint k = 0u; k < kLookupTurns; ++k) {
        const uvec2 pixel = ownPixel(thread, k);
        bool waits = false;
        if (insideView(pixel)) {
            const uint index = pixelIndex(pixel);
            const VisiblePoint point = push.points.v[index];
            bool keeps = false;
            if (push.turn != kNone && turn != k) {
                const ProbeLookup lookup = lookupBefore(pixel, point);
                keeps = isKnown(point, lookup);
                if (keeps) push.indirect.v[index] = lookup.radiance;
                if (keeps && push.moved != 0u) push.lookups.v[index] = lookup;
            }
            waits = point.instance != kNone && !keeps;
            if (point.instance == kNone) {
                push.indirect.v[index] = vec3(0.0);
                if (push.moved != 0u || push.turn == kNone) push.lookups.v[index].instance = kNone;
            }
        }
        const uvec4 ballot = subgroupBallot(waits);
        if (waits) waiting[first + count + subgroupBallotExclusiveBitCount(ballot)] = thread + threads * k;
        count += subgroupBallotBitCount(ballot);
    }
    subgroupBarrier();
    for (uint i = gl_SubgroupInvocationID; i < count; i += gl_SubgroupSize) {
        const uint entry = waiting[first + i];
        const uint index = pixelIndex(ownPixel(entry % threads, entry / threads));
        const VisiblePoint point = push.points.v[index];
        const Shading shading = shadeVisiblePoint(point);
        const vec3 albedo = bsdfRefractsRoughly(shading.bsdf) ? vec3(0.0) : bsdfCosineAlbedo(shading.bsdf);
        const vec3 radiance = point.throughput * scatteredProbeLight(push.volumes, shading, albedo);
        push.indirect.v[index] = radiance;
        push.lookups.v[index] = ProbeLookup(radiance, point.chain == 0u ? point.instance : kNone, point.primitive);
    }
}
