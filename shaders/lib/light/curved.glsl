// Spheres, disks and cylinders, and their images under any linear map: directions are sampled in a space where the shape is
// round and has radius 1, and the density is carried over by the Jacobian of the map between the two spheres of directions.
#ifndef TL_LIB_LIGHT_CURVED_GLSL
#define TL_LIB_LIGHT_CURVED_GLSL

#include "lib/light/numeric.glsl"
#include "lib/light/sample.glsl"
#include "lib/octahedral.glsl"
#include "lib/sampling.glsl"

// world = centre + scale * worldFromLocal * local, worldFromLocal of order 1 (for round shapes a rotation).
struct LightFrame {
    mat3 worldFromLocal;
    mat3 localFromWorld;
    float scale;
    float determinant; // of worldFromLocal, absolute
    vec3 eye;          // the receiver, local
};

LightFrame makeLightFrame(Light light, mat3 axes, float scale, vec3 position) {
    LightFrame f;
    f.worldFromLocal = axes;
    f.localFromWorld = inverse(axes);
    f.scale = scale;
    f.determinant = abs(determinant(axes));
    f.eye = f.localFromWorld * ((position - light.position) / scale);
    return f;
}

// d(local solid angle) / d(world solid angle) about the world direction wi.
float solidAngleJacobian(LightFrame f, vec3 wi) {
    const float stretch = length(f.localFromWorld * wi);
    return 1.0 / (stretch * stretch * stretch * f.determinant);
}

LightSample curvedSample(Light light, LightFrame f, vec3 localToPoint, vec3 localNormal, float pdfLocal, vec2 uv) {
    const vec3 toPoint = f.worldFromLocal * localToPoint;
    const float distance = length(toPoint);
    const vec3 wi = toPoint / distance;
    const vec3 normal = normalize(localNormal * f.localFromWorld);
    return LightSample(wi, distance * f.scale, light.radiance, pdfLocal * solidAngleJacobian(f, wi), false, normal, uv);
}

// ---- Sphere: uniform in the cone that it fills --------------------------------------------------

LightFrame sphereFrame(Light light, vec3 position) {
    const float inverse = 1.0 / light.radius;
    return makeLightFrame(light, mat3(light.axisU * inverse, light.axisV * inverse, light.normal), light.radius, position);
}

// 1 - cos of the cone's half angle for the unit sphere at distance d > 1, without cancellation for any d.
float sphereOneMinusCos(float d) {
    const float cosine = sqrt((d - 1.0) * (d + 1.0)) / d;
    return 1.0 / (d * d * (1.0 + cosine));
}

LightSample sphereSample(Light light, vec3 position, vec2 u) {
    const LightFrame f = sphereFrame(light, position);
    const float d = length(f.eye);
    if (!(d > 1.0)) return kNoLight; // it emits outward
    const float oneMinusCos = sphereOneMinusCos(d);
    const vec3 inCone = sampleCone(u, oneMinusCos);
    const float offset = d * length(inCone.xy);
    const float t = d * inCone.z - safeSqrt((1.0 - offset) * (1.0 + offset));
    // The point hit, from its offset across the line of sight: the difference to a far eye would lose it.
    const vec2 across = t * inCone.xy;
    const vec3 point = basisAround(-f.eye / d) * vec3(across, -safeSqrt(1.0 - dot(across, across)));
    return curvedSample(light, f, point - f.eye, point, pdfSolidAngleCone(oneMinusCos), octahedralEncode(point));
}

float spherePdf(Light light, vec3 from, vec3 wi) {
    const LightFrame f = sphereFrame(light, from);
    const float d = length(f.eye);
    return d > 1.0 ? pdfSolidAngleCone(sphereOneMinusCos(d)) * solidAngleJacobian(f, wi) : 0.0;
}

// ---- Disk: chords across the line of sight, or by area when far ----------------------------------
//
// Near: the angle in the plane through the receiver and the disk's axis is uniform, and on the chord that it selects, the
// sine of elevation. Both are bounded, so the weight 1 / pdf never exceeds 2 pi, and it is constant in the limit of a close
// disk; away from it the density varies as the inverse of the chord's length. From 8 radii on, uniform by area varies less.

const float kDiskFar = 8.0;

struct DiskView {
    vec2 axis;        // unit, local, from the receiver's foot to the centre
    float height;     // of the receiver over the disk
    float begin;      // signed distance from the foot to the first chord, along axis
    float angleRange; // between the first and the last chord, seen from the receiver
};

// Columns: half axes, then the normal. Circles give a rotation.
LightFrame diskFrame(Light light, vec3 position) {
    const float scale = sqrt(length(light.axisU) * length(light.axisV));
    return makeLightFrame(light, mat3(light.axisU / scale, light.axisV / scale, light.normal), scale, position);
}

DiskView diskView(vec3 eye) {
    const float offset = length(eye.xy);
    DiskView v;
    v.axis = offset > 0.0 ? -eye.xy / offset : vec2(1, 0);
    v.height = eye.z;
    v.begin = offset - 1.0;
    v.angleRange = accurateAtan2(2.0 * eye.z, eye.z * eye.z + (offset - 1.0) * (offset + 1.0));
    return v;
}

// Sine of elevation at the end of the chord at h in [0, 2] from the disk's first point, half the chord's length and its
// distance from the receiver.
float chordSine(DiskView v, float h, out float halfChord, out float distance) {
    halfChord = safeSqrt(h * (2.0 - h));
    distance = length(vec2(v.begin + h, v.height));
    return halfChord / length(vec2(halfChord, distance));
}

// d^2 / (pi cos), local.
float farDiskPdf(vec3 toPoint) {
    const float d = length(toPoint);
    return d / abs(toPoint.z) * d * d * kInvPi;
}

LightSample diskSample(Light light, vec3 position, vec2 u) {
    const LightFrame f = diskFrame(light, position);
    if (!(f.eye.z > 0.0)) return kNoLight;
    if (length(f.eye) > kDiskFar) {
        const vec2 point = sampleDisk(u);
        const vec3 toPoint = vec3(point, 0.0) - f.eye;
        return curvedSample(light, f, toPoint, vec3(0, 0, 1), farDiskPdf(toPoint), point);
    }
    const DiskView v = diskView(f.eye);
    // tan(a0 + angle) by the addition theorem, relative to the first chord.
    const vec2 cosSin = accurateCosSin(u.x * v.angleRange);
    const float h = clamp(cosSin.y * (v.begin * v.begin + v.height * v.height) /
                              (v.height * cosSin.x - v.begin * cosSin.y), 0.0, 2.0);
    float halfChord, distance;
    const float sineEnd = chordSine(v, h, halfChord, distance);
    const float sine = (2.0 * u.y - 1.0) * sineEnd;
    const float r = length(vec2(halfChord, distance));
    const float oneMinusSine = distance / r * (distance / (r + halfChord)) + (1.0 - abs(2.0 * u.y - 1.0)) * sineEnd;
    const float x = clamp(distance * sine / safeSqrt(oneMinusSine * (1.0 + abs(sine))), -halfChord, halfChord);

    const vec2 onDisk = (h - 1.0) * v.axis + x * vec2(-v.axis.y, v.axis.x);
    return curvedSample(light, f, vec3(onDisk, 0.0) - f.eye, vec3(0, 0, 1), 0.5 / (v.angleRange * sineEnd), onDisk);
}

float diskPdf(Light light, vec3 from, vec3 point, vec3 wi) {
    const LightFrame f = diskFrame(light, from);
    if (!(f.eye.z > 0.0) || dot(wi, light.normal) >= 0.0) return 0.0;
    const vec2 onDisk = (f.localFromWorld * ((point - light.position) / f.scale)).xy;
    if (length(f.eye) > kDiskFar) return farDiskPdf(vec3(onDisk, 0.0) - f.eye) * solidAngleJacobian(f, wi);
    const DiskView v = diskView(f.eye);
    float halfChord, distance;
    const float sineEnd = chordSine(v, clamp(1.0 + dot(onDisk, v.axis), 0.0, 2.0), halfChord, distance);
    return 0.5 / (v.angleRange * sineEnd) * solidAngleJacobian(f, wi);
}

// ---- Cylinder: lines of its visible side --------------------------------------------------------
//
// The angle about the axis, seen from the receiver, is uniform in the range that the cylinder fills; on the line that it
// selects, the sine of elevation: d(solid angle) = d(angle) d(sine), so the density is the inverse of the two ranges.

struct CylinderView {
    float radius;     // distance of the receiver from the axis, above 1
    vec2 toAxis;      // unit, in local yz
    float halfAngle;  // under which the cylinder is seen
    float x0, x1;     // its ends along the axis, from the receiver
};

LightFrame cylinderFrame(Light light, vec3 position) {
    const float scale = sqrt(length(light.axisV) * light.radius);
    const mat3 axes = mat3(normalize(light.axisU), light.axisV / scale, light.normal * (light.radius / scale));
    return makeLightFrame(light, axes, scale, position);
}

CylinderView cylinderView(Light light, LightFrame f) {
    const float halfLength = 0.5 * length(light.axisU) / f.scale;
    CylinderView v;
    v.radius = length(f.eye.yz);
    v.toAxis = -f.eye.yz / v.radius;
    v.halfAngle = accurateAtan2(1.0, safeSqrt((v.radius - 1.0) * (v.radius + 1.0)));
    v.x0 = -halfLength - f.eye.x;
    v.x1 = halfLength - f.eye.x;
    return v;
}

// Distance to the cylinder in the plane across its axis, along (cosine, sine) from toAxis.
float cylinderDistance(CylinderView v, vec2 cosSin) {
    const float offset = v.radius * cosSin.y;
    return v.radius * cosSin.x - safeSqrt((1.0 - offset) * (1.0 + offset));
}

LightSample cylinderSample(Light light, vec3 position, vec2 u) {
    const LightFrame f = cylinderFrame(light, position);
    const CylinderView v = cylinderView(light, f);
    if (!(v.radius > 1.0)) return kNoLight; // only the inside is seen, through an open end
    const vec2 cosSin = accurateCosSin((2.0 * u.x - 1.0) * v.halfAngle);
    const float distance = cylinderDistance(v, cosSin);
    const float range = elevationRange(v.x0, v.x1, distance);
    const float begin = v.x0 / length(vec2(v.x0, distance));
    const float sine = clamp(begin + u.y * range, -1.0, 1.0);
    const float x = clamp(distance * sine / safeSqrt((1.0 - sine) * (1.0 + sine)), v.x0, v.x1);
    const float across = distance * cosSin.y;
    const vec2 point = across * vec2(-v.toAxis.y, v.toAxis.x) - safeSqrt((1.0 - across) * (1.0 + across)) * v.toAxis;
    const vec2 uv = vec2((x - v.x0) / (v.x1 - v.x0), accurateAtan2(point.y, point.x) * kInvTwoPi + 0.5);
    return curvedSample(light, f, vec3(x, point - f.eye.yz), vec3(0.0, point), 0.5 / (v.halfAngle * range), uv);
}

float cylinderPdf(Light light, vec3 from, vec3 wi) {
    const LightFrame f = cylinderFrame(light, from);
    const CylinderView v = cylinderView(light, f);
    if (!(v.radius > 1.0)) return 0.0;
    const vec2 w = safeNormalize(vec3((f.localFromWorld * wi).yz, 0.0), vec3(v.toAxis, 0.0)).xy;
    const vec2 cosSin = vec2(dot(w, v.toAxis), v.toAxis.x * w.y - v.toAxis.y * w.x);
    const float range = elevationRange(v.x0, v.x1, cylinderDistance(v, cosSin));
    return 0.5 / (v.halfAngle * range) * solidAngleJacobian(f, wi);
}

#endif
