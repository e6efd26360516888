// Light of two or more bounces that visible points reflect diffusely, from the probes there.
//
// Of a picture that stands still each pixel is looked up in one of kLookupTurns frames; in the others it keeps what it was
// told: a sample of the same pixel as good as a new one. Not what mirrors and glass show, whose noise should not last.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeGatherPush push; };

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

// Whether a point is of the triangle that the pixel showed, without mirrors and glass, when it was looked up.
bool isKnown(VisiblePoint point, ProbeLookup lookup) {
    return point.instance != kNone && point.chain == 0u && point.instance == lookup.instance && point.primitive == lookup.primitive;
}

void main() {
    const uint threads = gl_WorkGroupSize.x * gl_WorkGroupSize.y;
    const uint thread = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    const uint first = kLookupTurns * gl_SubgroupID * gl_SubgroupSize;
    if (gl_GlobalInvocationID.xy == uvec2(0u)) countProbes(push.volumes);
    uint count = 0u;
    for (uint k = 0u; k < kLookupTurns; ++k) {
        const uvec2 pixel = ownPixel(thread, k);
        bool waits = false;
        if (insideView(pixel)) {
            const uint index = pixelIndex(pixel);
            const VisiblePoint point = push.points.v[index];
            const ProbeLookup lookup = push.lookups.v[index];
            const bool keeps = push.turn != kNone && push.turn != k && isKnown(point, lookup);
            waits = point.instance != kNone && !keeps;
            if (!waits) push.indirect.v[index] = keeps ? lookup.radiance : vec3(0.0);
            if (push.turn == kNone && !waits) push.lookups.v[index].instance = kNone;
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
