// Resampling: weighted reservoirs, and pairwise MIS weights (Bitterli 2022, thesis) in the defensive form of Lin et al. 2022
// (GRIS). Confidences: c of the canonical technique, cNeighbor of one neighbour's, cNeighbors the sum over all neighbours.
// The target functions stand for one sample x: pCanonical at the canonical point, pNeighbor at the neighbour's. The weights
// that all techniques give x sum to 1 wherever pCanonical is positive; elsewhere x brings nothing.
#ifndef TL_LIB_RESERVOIR_GLSL
#define TL_LIB_RESERVOIR_GLSL

#include "lib/math.glsl"

// c pCanonical : cNeighbors pNeighbor, the canonical share; targets of any scale.
float canonicalShare(float c, float cNeighbors, float pCanonical, float pNeighbor) {
    const float scale = max(pCanonical, pNeighbor);
    if (!(scale > 0.0)) return 0.0;
    const float a = c * (pCanonical / scale), b = cNeighbors * (pNeighbor / scale);
    return a / (a + b);
}

// Of the neighbour's technique for its own sample.
float pairwiseNeighbor(float c, float cNeighbors, float cNeighbor, float pCanonical, float pNeighbor) {
    if (!(pNeighbor > 0.0)) return 0.0;
    return cNeighbor / (c + cNeighbors) * (1.0 - canonicalShare(c, cNeighbors, pCanonical, pNeighbor));
}

// What one neighbour adds to the canonical technique's weight c / (c + cNeighbors) for the canonical sample.
float pairwiseCanonical(float c, float cNeighbors, float cNeighbor, float pCanonical, float pNeighbor) {
    return cNeighbor / (c + cNeighbors) * canonicalShare(c, cNeighbors, pCanonical, pNeighbor);
}

// Weighted reservoir sampling of a stream: whether the newcomer replaces what was kept. `u` in [0,1) is drawn for it alone.
bool reservoirTakes(inout float sum, float w, float u) {
    sum += w;
    return u * sum < w;
}

#endif
