// Bidirectional path tracing: what both passes share, and the recursive quantities of the weights.
//
// Weights (Veach 1997, 10.2, computed as in Georgiev et al. 2012, "Implementing Vertex Connection and Merging"). A path of k
// vertices can be made by each split into s vertices of a light subpath and t of an eye subpath, with density p_s by area
// of all vertices. The strategy used weighs p_s^b / sum_j p_j^b = 1 / (1 + wLight + wEye), b = 2 (power) or 1 (balance).
// For vertex i of a subpath, with forward density p_i by area given the vertex before and reverse density r_i,
//   dVCM_i = (1 / p_i)^b
//   dVC_i  = (g_{i-1} / p_i)^b (dVCM_{i-1} + r_{i-2}^b dVC_{i-1}),   g_{i-1}: solid angle to area at i-1, r_{i-2} by solid angle
// so that wLight = r_{s-1}^b (dVCM_{s-1} + r_{s-2}^b dVC_{s-1}), and wEye alike. A specular vertex can't be connected to:
// its dVCM is 0, and the discrete probabilities of both directions cancel.
//   Light side, first surface y1: next-event estimation draws the light's point with density pLight by solid angle at y1,
//   subpaths with pEmit by area and solid angle; c0 is the cosine there (1 for lights at infinity, whose pEmit is by solid
//   angle and by area of the disk), c1 that at y1: dVCM = (pLight c0 / (pEmit c1))^b, dVC = (c0 / (pEmit c1))^b.
//   Eye side, visible point z1 seen directly: pixels are sampled one by one while all N light subpaths may reach any of
//   them; N and the density of a pixel's film give dVCM = (d^2 filmArea cos^3 / c1)^b, filmArea at distance 1 and cos on
//   the optical axis; the lens cancels. Behind mirrors no light subpath reaches the camera: dVCM = 0. dVC = 0.
//   The visibility node stopped at z1 with probability q, which it takes from what pdfs say of the directions sampled
//   there: as a vertex z1 has density q p, and directions sampled there pdf / q.
// Roulette and cut-outs are left out of the weights, alike in all strategies, so weights still sum to 1.
#ifndef TL_PASSES_BPT_COMMON_GLSL
#define TL_PASSES_BPT_COMMON_GLSL

#include "lib/fixed_point.glsl"
#include "scene/emission.glsl"
#include "scene/pass.glsl"
#include "scene/shading.glsl"
#include "scene/visible_point.glsl"

#if TL_BPT_POWER
float misPower(float ratio) { return ratio * ratio; }
#else
float misPower(float ratio) { return ratio; }
#endif

// At one vertex of a subpath.
struct MisState {
    float dVCM;
    float dVC;
};

// Density of the reverse direction matters where strategies lie further back.
float strategiesBehind(MisState mis, float pdfReverse) { return mis.dVCM + misPower(pdfReverse) * mis.dVC; }

// From a vertex left under |cos| `cosOut` to one met `distance` further on under `cosIn`.
MisState misScatter(MisState mis, bool specular, float pdf, float pdfReverse, float cosOut) {
    if (specular) return MisState(0.0, misPower(cosOut) * mis.dVC);
    return MisState(misPower(1.0 / pdf), misPower(cosOut / pdf) * strategiesBehind(mis, pdfReverse));
}
MisState misArrive(MisState mis, float distance, float cosIn) {
    return MisState(mis.dVCM * misPower(distance * distance / cosIn), mis.dVC * misPower(1.0 / cosIn));
}

float cosGeometric(Surface s, vec3 w) { return abs(dot(s.geometricNormal, w)); }

// Density with which a path that comes from `from` is sent to `to`, both unit and away from the surface.
float scatterPdf(Surface s, vec3 from, vec3 to, float footprint) {
    float pdfSolidAngle;
    evalBsdf(prepareShading(s, from, footprint), to, pdfSolidAngle);
    return pdfSolidAngle;
}

// Shading normals are bent towards grazing eyes, so a mirror seen from the other end may have another normal. Then only
// one direction of a specular path exists.
bool specularReverses(Shading shading, vec3 wi, float footprint) {
    const Material m = TL_SCENE.materials.v[shading.surface.material];
    const vec3 n = facingNormal(m, shading.surface, wi, footprint);
    return abs(dot(n, shading.frame[2])) > 1.0 - 1e-5;
}

// Radiance that stands for 1 in the fixed-point splats: of the order of what the lights' power would give if it were spread
// over the scene's extent. Scales with emission, and not with the size of the stage.
float splatUnit() { return safeDivide(TL_SCENE.lightPower, sqr(TL_SCENE.boundsRadius)); }
uint splatWord(uint pixel, uint pathClass) { return kBptSplatWords * pixel + kFixedWords * pathClass; }

#endif
