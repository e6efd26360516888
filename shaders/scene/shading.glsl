// A surface ready to be shaded: its frame, its BSDF, and which directions it may send light to.
#ifndef TL_SCENE_SHADING_GLSL
#define TL_SCENE_SHADING_GLSL

#include "scene/lights.glsl"
#include "scene/visible.glsl"

struct Shading {
    Surface surface;
    vec3 wo;        // unit, world space
    mat3 frame;     // columns: tangent, bitangent, normal; the normal is on the side of wo
    Bsdf bsdf;
    vec3 woLocal;
};

// `transport`: kTransportRadiance where wo leads to the camera, kTransportImportance where it leads to a light.
// `leastRoughness`: of rough lobes that reflect (path space regularisation, Kaplanyan and Dachsbacher 2013).
Shading prepareShading(Surface s, vec3 wo, float footprint, uint transport, float leastRoughness) {
    Shading shading;
    shading.surface = s;
    shading.wo = wo;
    const Material m = TL_SCENE.materials.v[s.material];
    shading.frame = basisAround(facingNormal(m, s, wo, footprint));
    shading.woLocal = wo * shading.frame;
    BsdfParams params = loadBsdfParams(m, s, footprint);
    if (params.transmission == 0.0) params.roughness = bsdfWidened(params.roughness, leastRoughness);
    params.clearcoatRoughness = bsdfWidened(params.clearcoatRoughness, leastRoughness);
    shading.bsdf = bsdfPrepare(params, shading.woLocal, dot(wo, s.geometricNormal) > 0.0, transport);
    return shading;
}

Shading prepareShading(Surface s, vec3 wo, float footprint, uint transport) {
    return prepareShading(s, wo, footprint, transport, 0.0);
}

Shading prepareShading(Surface s, vec3 wo, float footprint) {
    return prepareShading(s, wo, footprint, kTransportRadiance);
}

// For paths from lights, which carry flux: cosines of shading normals belong to the BSDF, those of geometric normals to
// the geometry, and the two sides trade places. Veach 1997, eq. 5.19; 1 where the normals agree. Times evalBsdf or
// BsdfSample.weight of a shading prepared for importance.
float shadingNormalCorrection(Shading shading, vec3 wi) {
    const vec3 n = shading.surface.geometricNormal;
    return safeDivide(abs(shading.woLocal.z * dot(wi, n)), abs(dot(shading.wo, n) * dot(wi, shading.frame[2])));
}

// Interpolated normals must not let light through the true surface: reflected directions stay on wo's side of it,
// refracted ones cross it.
bool crossesRightly(Shading shading, vec3 wi, bool transmitted) {
    const bool sameSide = dot(wi, shading.surface.geometricNormal) * dot(shading.wo, shading.surface.geometricNormal) > 0.0;
    return sameSide != transmitted;
}

// f |cos| for a world direction; 0 for delta lobes. pdfSolidAngle is that of BSDF sampling.
vec3 evalBsdf(Shading shading, vec3 wi, out float pdfSolidAngle) {
    const vec3 wiLocal = wi * shading.frame;
    const vec3 f = bsdfEval(shading.bsdf, shading.woLocal, wiLocal, pdfSolidAngle);
    return crossesRightly(shading, wi, wiLocal.z < 0.0) ? f : vec3(0.0);
}

// What a light sample brings, f L / pdf with visibility. `weighted`: times the power heuristic's weight against BSDF
// sampling.
vec3 directLight(Shading shading, DirectSample d, bool weighted) {
    if (!(d.pdfSolidAngle > 0.0)) return vec3(0.0);
    float pdfBsdf;
    const vec3 f = evalBsdf(shading, d.wi, pdfBsdf);
    const float weight = weighted && !d.delta ? powerHeuristic(d.pdfSolidAngle, pdfBsdf) : 1.0;
    const float pdf = (TL_FRAME.flags & kFrameUncompensated) != 0u ? uncompensatedPdf(d) : d.pdfSolidAngle;
    const vec3 contribution = f * d.radiance * (weight / pdf);
    if (!(maxComponent(contribution) > 0.0)) return vec3(0.0);
    return contribution * visibilityToLight(shading.surface, d.wi, d.distance, d.normal, d.extent);
}

// Direct light by one light sample.
vec3 sampledDirectLight(Shading shading, bool weighted, inout Sampler rng) {
    return directLight(shading, sampleDirect(shading.surface.position, rng), weighted);
}

#endif
