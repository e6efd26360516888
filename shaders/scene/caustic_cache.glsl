// Irradiance that arrives on surfaces through mirrors and glass, coarsely, anywhere in the scene: what the caustics node
// leaves for rays that hit rough surfaces out of sight.
//
// A patch is the part of an instance that faces along one axis (the largest component of its normal), in one square of
// side h across the axis and one layer along it. A photon of flux F adds F |n_axis| / h^2, where h^2 / |n_axis| is the
// area of the surface above the square; so the integral of the irradiance over the patch is the flux that landed on it.
// A surface may pass through two layers within its square, since it rises by 2 h at most: the sum of three layers of 2 h
// has all of it.
// Bias: irradiance is constant on each patch. Where a surface ends or turns to another axis within a square, the share of
// the square that it lacks is lost: a sphere of radius 19 h gives back 97% of the flux that fell on it. Parallel sheets of
// one instance closer than 4 h may share their light.
#ifndef TL_SCENE_CAUSTIC_CACHE_GLSL
#define TL_SCENE_CAUSTIC_CACHE_GLSL

#include "lib/math.glsl"
#include "lib/rng.glsl"
#include "scene/bindings.glsl"
#include "shared/caustics.h"

const float kCausticPatchSize = 1.0 / 32.0; // h over the radius of the scene's bounds
const float kCausticPatchLayer = 2.0;       // over h

// Of a patch across its axis, m^2.
float causticPatchArea() { return sqr(TL_SCENE.boundsRadius * kCausticPatchSize); }

struct CausticPlace {
    uint instance;
    uint side;     // axis, and 4 on its negative side
    ivec3 cell;    // x, y across the axis; z: layer
    float inverseArea;
};

// `normal`: unit, geometric, on the side that light arrives from.
CausticPlace causticPlace(uint instance, vec3 position, vec3 normal) {
    // Ties between axes are broken alike for all triangles of a plane: rounding must not decide.
    const vec3 n = abs(normal) * vec3(1.02, 1.01, 1.0);
    const uint axis = n.x >= n.y && n.x >= n.z ? 0u : n.y >= n.z ? 1u : 2u;
    const float size = TL_SCENE.boundsRadius * kCausticPatchSize;
    const vec3 p = position / size;
    CausticPlace place;
    place.instance = instance;
    place.side = normal[axis] < 0.0 ? axis + 4u : axis;
    place.cell = ivec3(floor(vec3(p[(axis + 1u) % 3u], p[(axis + 2u) % 3u], p[axis] / kCausticPatchLayer)));
    place.inverseArea = abs(normal[axis]) / (size * size);
    return place;
}

// x: the slot where probing begins, y: the key. Two hashes, so that 48 bits tell patches apart.
uvec2 causticPatchHash(CausticPlace place) {
    const uvec3 h = pcg3d(uvec3(place.cell) ^ pcg(place.instance * 8u + place.side));
    return uvec2(h.x & (kCausticPatches - 1u), max(h.y, 1u));
}

uint nextCausticPatch(uint slot) { return (slot + 1u) & (kCausticPatches - 1u); }

// The slot of a patch, made where there is none; kNone where the table is full here: below a quarter of its slots in use,
// the chance of a run this long is 1e-9.
uint insertCausticPatch(CausticPatchRef cache, uvec2 hash) {
    uint slot = hash.x;
    for (uint i = 0u; i < kCausticPatchProbes; ++i) {
        const uint key = atomicCompSwap(cache.v[slot].key, 0u, hash.y);
        if (key == 0u || key == hash.y) return slot;
        slot = nextCausticPatch(slot);
    }
    return kNone;
}

struct CachedCaustic {
    vec3 irradiance; // W/m^2 through chains of mirrors and glass
    float density;   // of photons that land, of each that is emitted, 1/m^2
};

// On the side of the surface that `normal` (unit, geometric) points to.
CachedCaustic cachedCaustic(CausticPatchRef cache, uint instance, vec3 position, vec3 normal) {
    CausticPlace place = causticPlace(instance, position, normal);
    const int layer = place.cell.z;
    CachedCaustic sum = CachedCaustic(vec3(0.0), 0.0);
    for (int offset = -1; offset <= 1; ++offset) {
        place.cell.z = layer + offset;
        const uvec2 hash = causticPatchHash(place);
        uint slot = hash.x;
        for (uint i = 0u; i < kCausticPatchProbes; ++i) {
            const uint key = cache.v[slot].key;
            if (key == hash.y) {
                sum.irradiance += cache.v[slot].irradiance;
                sum.density += cache.v[slot].density;
            }
            if (key == hash.y || key == 0u) break;
            slot = nextCausticPatch(slot);
        }
    }
    return sum;
}

#endif
