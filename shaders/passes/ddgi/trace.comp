// Rays of the selected probes: the light that the surfaces they meet scatter back. Direct light by one light sample, light of
// more bounces from the probes as the last round left them, caustics from their cache and from the frame's photons. What
// surfaces emit is not taken: probes hold scattered light.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/ddgi.h"

layout(push_constant, scalar) uniform Push { ProbeUpdatePush push; };

#define TL_LEAST_ROUGHNESS 0.45
#define TL_PROBE_ROOTS ((push.flags & (kProbeUpdateBounce | kProbeUpdateActive | kProbeUpdateFresh)) == 0u)
#include "scene/probe_rays.glsl"
#include "scene/rough.glsl"

layout(local_size_x = 64) in;

const uint kPlacing = kProbeUpdateRestart | kProbeUpdateMoved;

// Caustics are met by few rays, and are bright: rays are sent to photons as well. Per area that reflects light at `cosine`,
// `distance` away, a probe's rays hit b, and a of its samples of photons have landed there; either's share of the light is its
// part in a + b (the balance heuristic by area, Veach 1997, section 9.2), so that a photon brings L b / (a + b), about, where
// nothing bounds L / p.
float photonsPerArea(uint rays, float density) {
#if TL_CAUSTIC_CACHE
    return push.causticState.v[0].emitted > 0u ? float(photonRays(rays)) * density : 0.0;
#else
    return 0.0;
#endif
}

float raysPerArea(uint rays, float cosine, float distance) { return float(rays) * cosine / (4.0 * kPi * sqr(distance)); }

ProbeRay rayTold(RoughHit hit, vec3 direction, uint rays, float spacing, inout Sampler rng) {
    const float distance = hit.distance < kFloatMax ? hit.distance / spacing : kProbeRayMissed;
    ProbeRay ray = ProbeRay(direction, distance, vec3(0.0), hit.back ? kProbeRayBack : 0u);
    // Probes that look for their places need to know only which backs are lit, and may not ask volumes that have not begun.
    const bool placing = (push.flags & kPlacing) != 0u;
    if (!placing) ray.radiance = hit.passed;
    if (!hit.found || (placing && !hit.back)) return ray;
    vec3 direct;
    if (placing) {
        direct = scatteredDirect(hit.shading, rng);
    } else {
        const ScatteredLight light = scatteredLight(push.volumes, push.causticCache, hit, rng);
        direct = light.direct;
        const vec3 known = hit.throughput * light.probes;
        float share = 1.0;
        const float a = photonsPerArea(rays, light.photonDensity);
        if (!hit.specular && a > 0.0) {
            const float b = raysPerArea(rays, abs(dot(hit.shading.surface.geometricNormal, direction)), hit.distance);
            share = b / (a + b);
        }
        ray.radiance += hit.throughput * (direct + share * light.caustic) + known;
        if ((push.flags & kProbeUpdateTally) != 0u)
            ray.flags |= packUnorm4x8(vec4(0.0, mix(known / ray.radiance, vec3(0.0), lessThanEqual(ray.radiance, vec3(0.0)))));
    }
    if (!hit.specular && maxComponent(direct) > 0.0) ray.flags |= kProbeRayLit;
    return ray;
}

// Where one of the frame's photons has landed, as a probe sees it.
struct PhotonSeen {
    vec3 direction; // towards it
    float distance;
    float cosine; // at the surface; 0: the probe is not to be lit
    vec3 flux;    // of the samples that it stands for, W
};

PhotonSeen samplePhoton(vec3 origin, uint k, uint samples, inout Sampler rng) {
    PhotonSeen seen = PhotonSeen(vec3(0.0), 0.0, 0.0, vec3(0.0));
#if TL_CAUSTIC_CACHE
    const uint emitted = push.causticState.v[0].emitted;
    if (emitted == 0u || (push.flags & kPlacing) != 0u) return seen;
    const float place = (float(k) + sample1D(rng)) / float(samples);
    const Photon photon = push.photons.v[min(uint(place * float(emitted)), emitted - 1u)];
    const vec3 way = photon.position - origin;
    const vec3 front = octahedralUnpack(photon.normal);
    const vec3 normal = dot(front, octahedralUnpack(photon.direction)) < 0.0 ? -front : front;
    seen.distance = length(way);
    if (!(maxComponent(photon.flux) > 0.0 && seen.distance > 0.0)) return seen;
    seen.direction = way / seen.distance;
    seen.cosine = max(-dot(normal, seen.direction), 0.0);
    seen.flux = float(emitted) / float(samples) * photon.flux;
#endif
    return seen;
}

// As one more among `rays` others: what it brings adds to theirs.
ProbeRay photonTold(RoughHit hit, PhotonSeen photon, uint rays) {
    ProbeRay ray = ProbeRay(photon.direction, kProbeRayMissed, vec3(0.0), 0u);
#if TL_CAUSTIC_CACHE
    if (!hit.found || hit.specular || abs(hit.distance - photon.distance) > 1e-3 * photon.distance) return ray;
    const float a = photonsPerArea(rays, causticAt(push.causticCache, hit).density);
    const float b = raysPerArea(rays, photon.cosine, photon.distance);
    if (a > 0.0)
        ray.radiance = hit.throughput * bsdfSmoothAlbedo(hit.shading.bsdf) * kInvPi * photon.flux * (a * b / (a + b));
#endif
    return ray;
}

void main() {
    ProbeVolume volume = push.volume.v[0];
    const uint perProbe = probeRayStride(volume.rays);
    const uint total = volume.selected * perProbe;
    const uint first = spreadGroup() * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    for (uint i = first; i < total; i += gl_NumWorkGroups.x * gl_WorkGroupSize.x) {
        const uint index = push.turns.v[i / perProbe].probe;
        const uint ray = i % perProbe;
        const Probe probe = volume.probes.v[index];
        const vec3 origin = probePosition(volume, probeCoordinates(volume, index), probe);
        Sampler rng = probeSampler(push.firstProbe + index, ray, probe.updates);
        vec3 direction;
        PhotonSeen photon;
        const bool toPhoton = ray >= volume.rays;
        if (toPhoton) {
            photon = samplePhoton(origin, ray - volume.rays, photonRays(volume.rays), rng);
            direction = photon.direction;
        } else {
            direction =
                probeRayRotation(push.firstProbe + index, probe.updates) * probeLatticeDirection(ray, volume.rays);
        }
        ProbeRay result = ProbeRay(vec3(0.0), kProbeRayMissed, vec3(0.0), 0u);
        if (!toPhoton || photon.cosine > 0.0) {
            const RoughHit hit = traceToRough(origin, direction, 0.0, rng);
            if (toPhoton) result = photonTold(hit, photon, volume.rays);
            else result = rayTold(hit, direction, volume.rays, volume.spacing, rng);
        }
        if (!isFinite(result.radiance)) {
            result.radiance = vec3(0.0);
            atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);
        }
        push.rays.v[i] = result;
    }
    countRays(rayCount);
}
