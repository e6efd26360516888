// Triangles and parallelograms, sampled uniformly by solid angle.
#ifndef TL_LIB_LIGHT_PLANAR_GLSL
#define TL_LIB_LIGHT_PLANAR_GLSL

#include "lib/light/distribution.glsl"
#include "lib/light/numeric.glsl"
#include "lib/light/sample.glsl"

// A triangle seen from the origin. All its quantities keep their relative precision however small the triangle appears, so
// sampling needs no fallback: Arvo's map tends to the uniform one by area.
struct SphericalTriangle {
    vec3 d0, d1, d2;      // unit directions to the corners
    vec3 inverseDistance; // of the corners
    float g0, g1, g2;     // tan(solidAngle / 2) = g0 / (g1 + g2): Van Oosterom & Strackee 1983
    float solidAngle;
};

// Corners p, p + e1 and p + e2. Solid angle 0 where it is degenerate.
SphericalTriangle sphericalTriangle(vec3 p, vec3 e1, vec3 e2) {
    const vec3 p1 = p + e1, p2 = p + e2;
    SphericalTriangle t;
    t.inverseDistance = 1.0 / vec3(length(p), length(p1), length(p2));
    t.d0 = p * t.inverseDistance.x;
    t.d1 = p1 * t.inverseDistance.y;
    t.d2 = p2 * t.inverseDistance.z;
    // The determinant from the edges: that of three nearly equal directions would cancel.
    t.g0 = abs(dot(t.d0, cross(e1 * t.inverseDistance.y, e2 * t.inverseDistance.z)));
    t.g1 = dot(t.d0 + t.d1, t.d2);
    t.g2 = 0.5 * lengthSquared(t.d0 + t.d1); // 1 + d0.d1
    t.solidAngle = 2.0 * accurateAtan2(t.g0, t.g1 + t.g2);
    if (!isFinite(t.solidAngle)) t.solidAngle = 0.0;
    return t;
}

// Weights of the three corners of the point that is found like so (Arvo 1995): move along edge 0-2 until the triangle with
// corner 1 has solid angle `part`, then from corner 1 towards that point by a cosine uniform in u.
// The half vector of corner 0 and the point on the edge solves a linear equation (Peters 2021, "BRDF Importance Sampling for
// Polygonal Lights", sec. 4), which keeps the map precise for tiny triangles.
vec3 sampleSphericalTriangle(SphericalTriangle t, float part, float u) {
    const vec2 cosSin = accurateCosSin(0.5 * part);
    vec2 halfWeights = vec2(t.g0 * cosSin.x - t.g1 * cosSin.y, t.g2 * cosSin.y);
    halfWeights /= abs(halfWeights.x) + abs(halfWeights.y);
    const vec3 halfVector = halfWeights.x * t.d0 + halfWeights.y * t.d2;
    const vec2 edge = 2.0 * dot(t.d0, halfVector) / lengthSquared(halfVector) * halfWeights - vec2(1, 0);

    const float k = 0.5 * lengthSquared(edge.x * t.d0 + edge.y * t.d2 - t.d1); // 1 - cos of the arc from corner 1
    const float q = sqrt(u * (2.0 - u * k) / max(2.0 - k, 1e-6));
    const float p = 1.0 - u * k - q * (1.0 - k);
    const vec3 weights = max(vec3(q * edge.x, p, q * edge.y) * t.inverseDistance, vec3(0.0));
    return weights / (weights.x + weights.y + weights.z);
}

// Coordinates of q along e1 and e2, after projection to their plane.
vec2 planarCoordinates(vec3 q, vec3 e1, vec3 e2) {
    const float scale = 1.0 / max(maxComponent(abs(e1)), maxComponent(abs(e2)));
    e1 *= scale;
    e2 *= scale;
    const vec3 n = cross(e1, e2);
    return scale * vec2(dot(q, cross(e2, n)), dot(q, cross(n, e1))) / dot(n, n);
}

LightSample planarSample(Light light, vec3 toPoint, vec2 uv, vec3 radiance, float pdfSolidAngle) {
    const float distance = length(toPoint);
    return LightSample(toPoint / distance, distance, radiance, pdfSolidAngle, false, light.normal, uv);
}

LightSample triangleSample(Light light, vec3 position, vec2 u) {
    const vec3 p = light.position - position;
    const SphericalTriangle t = sphericalTriangle(p, light.axisU, light.axisV);
    if (dot(light.normal, p) >= 0.0 || t.solidAngle <= 0.0) return kNoLight;
    const vec2 uv = sampleSphericalTriangle(t, u.x * t.solidAngle, u.y).yz;
    return planarSample(light, p + uv.x * light.axisU + uv.y * light.axisV, uv, light.radiance, 1.0 / t.solidAngle);
}

float trianglePdf(Light light, vec3 from, vec3 wi) {
    if (dot(light.normal, wi) >= 0.0) return 0.0;
    return safeDivide(1.0, sphericalTriangle(light.position - from, light.axisU, light.axisV).solidAngle);
}

// The rectangle (or sheared: parallelogram) as a fan of two triangles about its corner (-1/2, -1/2).
struct SphericalRect {
    SphericalTriangle lower; // corners (1,0), (0,0), (1,1) in units of the edges
    SphericalTriangle upper; // corners (1,1), (0,0), (0,1)
    float solidAngle;
};

SphericalRect sphericalRect(Light light, vec3 position) {
    const vec3 u = light.axisU, v = light.axisV, center = light.position - position;
    SphericalRect r;
    r.lower = sphericalTriangle(center + 0.5 * (u - v), -u, v);
    r.upper = sphericalTriangle(center + 0.5 * (u + v), -u - v, -u);
    // A receiver less than 1e-6 of the edges from the plane, just below the diagonal, is where rounding shows in the sum.
    r.solidAngle = min(r.lower.solidAngle + r.upper.solidAngle, kTwoPi);
    return r;
}

// Position in units of the edges, from the corner (-1/2, -1/2).
vec2 sampleSphericalRect(SphericalRect r, vec2 u) {
    const float part = u.x * (r.lower.solidAngle + r.upper.solidAngle);
    const bool lower = part < r.lower.solidAngle || r.upper.solidAngle <= 0.0;
    SphericalTriangle t = r.upper;
    if (lower) t = r.lower;
    const vec3 w = sampleSphericalTriangle(t, lower ? min(part, r.lower.solidAngle) : part - r.lower.solidAngle, u.y);
    return lower ? vec2(w.x + w.z, w.z) : vec2(w.x, w.x + w.z);
}

// UsdLux: seen from the emitting side the picture stands upright; its upper left corner is at (+x, +y).
vec2 rectTextureFromEdges(vec2 edges) { return vec2(1.0 - edges.x, edges.y); }
vec2 rectUv(Light light, vec3 point) {
    return rectTextureFromEdges(planarCoordinates(point - light.position, light.axisU, light.axisV) + 0.5);
}

// Density of choosing `uv` from the texture, by solid angle.
float rectTexturePdf(Light light, DistributionRef distributions, vec2 uv, float distance, float cosLight) {
    return distributionPdf(distributions.v[light.distribution], uv) * (distance / light.area) * (distance / cosLight);
}

// A texture is sampled by luminance half of the time and by solid angle else: the mixture is bounded where one of them
// alone is not (a receiver close to the light, a dark texel that covers much of the view).
LightSample rectSample(Light light, DistributionRef distributions, vec3 position, vec2 u) {
    const vec3 center = light.position - position;
    const SphericalRect r = sphericalRect(light, position);
    if (dot(light.normal, center) >= 0.0 || r.solidAngle <= 0.0) return kNoLight;
    const bool textured = lightIsDistributed(light);
    vec2 edges;
    if (textured && u.x >= 0.5) {
        const vec2 uv = sampleDistribution(distributions.v[light.distribution], vec2(2.0 * u.x - 1.0, u.y));
        edges = rectTextureFromEdges(uv); // its own inverse
    } else {
        edges = sampleSphericalRect(r, vec2(textured ? 2.0 * u.x : u.x, u.y));
    }
    const vec2 uv = rectTextureFromEdges(edges);
    LightSample s = planarSample(light, center + (edges.x - 0.5) * light.axisU + (edges.y - 0.5) * light.axisV, uv,
                                 light.radiance, 1.0 / r.solidAngle);
    if (textured) {
        const float pdfTexture = rectTexturePdf(light, distributions, uv, s.distance, -dot(s.wi, light.normal));
        s.pdfSolidAngle = 0.5 * (s.pdfSolidAngle + pdfTexture);
    }
    return s;
}

float rectPdf(Light light, DistributionRef distributions, vec3 from, vec3 point, vec3 wi) {
    const float cosLight = -dot(wi, light.normal);
    if (cosLight <= 0.0) return 0.0;
    const float pdf = safeDivide(1.0, sphericalRect(light, from).solidAngle);
    if (!lightIsDistributed(light)) return pdf;
    return 0.5 * (pdf + rectTexturePdf(light, distributions, rectUv(light, point), length(point - from), cosLight));
}

#endif
