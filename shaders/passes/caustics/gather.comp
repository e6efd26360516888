// The pixel's caustic: what photons splat there, and where its point is seen through mirrors or glass (with kernels:
// anywhere), the density of photons around it (Jensen 1996). Path class L S+ D S* E.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/grid.glsl"
#include "passes/caustics/history.glsl"

layout(TL_PIXEL_GROUP) in;

const float kSameFacing = 0.8; // least cosine between normals of point and photon: 37 degrees
const float kFlatness = 0.25;  // height of the kernel over its radius

// Radiance per flux of a photon, by Epanechnikov's kernel in the tangent plane. evalBsdf holds the cosine to the shading
// normal, flux that to the true surface.
vec3 photonWeight(Shading shading, Photon photon, float radius) {
    const vec3 offset = photon.position - shading.surface.position;
    const float height = dot(offset, shading.surface.geometricNormal);
    const float across2 = (dot(offset, offset) - height * height) / (radius * radius);
    const vec3 normal = octahedralUnpack(photon.normal);
    if (across2 >= 1.0 || abs(height) > kFlatness * radius || dot(normal, shading.surface.geometricNormal) < kSameFacing)
        return vec3(0.0);
    const vec3 wi = octahedralUnpack(photon.direction);
    float pdfBsdf;
    const vec3 f = evalBsdf(shading, wi, pdfBsdf);
    const float cosine = abs(dot(wi, normal));
    return cosine > 0.0 ? f * (2.0 * kInvPi * (1.0 - across2) / (radius * radius * cosine)) : vec3(0.0);
}

vec3 gatherPhotons(VisiblePoint point, out uint arrivals) {
    const Shading shading = shadeVisiblePoint(point);
    const float radius = min(push.gatherRadius * point.footprint, 0.5 * gatherCellSize());
    const vec3 position = shading.surface.position;
    const ivec3 low = gatherCell(position - radius), high = gatherCell(position + radius);
    // The lists' order is chance: sums in fixed point don't depend on it.
    const vec3 scale = point.throughput / radianceUnit();
    uvec2 sums[3] = uvec2[3](uvec2(0u), uvec2(0u), uvec2(0u));
    arrivals = 0u;
    for (uint i = 0u; i < 8u; ++i) {
        const ivec3 cell = low + ivec3(i & 1u, (i >> 1) & 1u, i >> 2);
        if (any(greaterThan(cell, high))) continue;
        for (uint index = push.heads.v[gatherHead(cell)]; index != kNone;) {
            const Photon photon = push.photons.v[index];
            index = photon.next;
            if (gatherCell(photon.position) != cell) continue; // of another cell with this hash
            const vec3 radiance = scale * photon.flux * photonWeight(shading, photon, radius);
            if (maxComponent(radiance) == 0.0) continue;
            if (!(minComponent(radiance) >= 0.0 && maxComponent(radiance) < kFixedLimit)) {
                atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
                continue;
            }
            for (uint c = 0u; c < 3u; ++c) fixedAdd(sums[c], radiance[c]);
            ++arrivals;
        }
    }
    return radianceUnit() * vec3(floatFromFixed(sums[0]), floatFromFixed(sums[1]), floatFromFixed(sums[2]));
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    const VisiblePoint point = push.points.v[index];
    vec3 caustic = takeSum(push.splats, index);
    if (point.instance != kNone && (point.chain > 0u || (push.flags & kCausticsKernel) != 0u)) {
        uint arrivals;
        caustic += gatherPhotons(point, arrivals);
        countArrivals(arrivals);
    }
    const uint lit = subgroupAdd(maxComponent(caustic) > 0.0 ? 1u : 0u);
    if (subgroupElect() && lit > 0u) atomicAdd(push.state.v[0].lit, lit);

    // Averages of several frames are the application's, and need frames that don't share what they know.
    const vec4 before = remembered(index, point);
    const float frames = min(before.w + push.share, push.historyFrames);
    const vec3 mean = mix(before.rgb, caustic, min(push.share / frames, 1.0));
    push.mean.v[index] = vec4(mean, frames);
    push.caustic.v[index] = TL_FRAME.sampleIndex == 0u ? mean : caustic;
}
