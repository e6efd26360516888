// After a change: emission's history brought to where its emitters are seen now, less what has changed.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseEmissionPush push; };

#include "passes/denoise/common.glsl"
#include "scene/previous.glsl"

layout(TL_PIXEL_GROUP) in;

const float kSigma = 3.0;        // of nine samples that are bright or dark, five must contradict history
const float kMovingFrames = 8.0; // longest history that was resampled
const int kMost = 5;             // of eight neighbours
const float kSettled = 4.0;      // frames; fewer tell little, and are soon forgotten
const float kStill = 1e-3;       // pixels: no motion but rounding
const float kNotKept = -1.0;     // frames of a history that accumulate_emission.comp shall not begin with this one either

bool sameRadiance(Light a, Light b) { return a.radiance == b.radiance && a.kind == b.kind && a.image == b.image; }

bool samePlace(Light a, Light b) {
    return a.position == b.position && a.axisU == b.axisU && a.axisV == b.axisV && a.normal == b.normal &&
           a.radius == b.radius && a.cosHalfAngle == b.cosHalfAngle;
}

Light lastLight(uint light) { return TL_FRAME.previousScene.v[0].lights.v[light]; }

bool sameInfinite() {
    if (TL_FRAME.previousScene.v[0].infiniteLightCount != TL_SCENE.infiniteLightCount) return false;
    for (uint i = 0u; i < TL_SCENE.infiniteLightCount; ++i) {
        const Light light = TL_SCENE.lights.v[i];
        if (!sameRadiance(light, lastLight(i)) || !samePlace(light, lastLight(i))) return false;
    }
    return true;
}

// Brings a history to this frame's lights, and returns by how much brighter they are. Where mirrors or glass choose between
// lights it is of several, and is let go when the one seen last changes.
float relight(inout DenoiseEmission h, bool specular) {
    if (h.light == kEmitterNone || !frameFlag(kFrameChanged)) return 1.0;
    if (h.light == kEmitterInfinite) {
        if (!sameInfinite()) h.frames = 0.0;
        return 1.0;
    }
    const Light before = lastLight(h.light);
    h.light = min(currentLight(h.light), kEmitterNone);
    if (h.light == kEmitterNone) {
        h.frames = 0.0;
        return 1.0;
    }
    const Light now = TL_SCENE.lights.v[h.light];
    const bool same = sameRadiance(now, before);
    const bool lit = any(greaterThan(mix(vec3(0.0), now.radiance, equal(before.radiance, vec3(0.0))), vec3(0.0)));
    if (!samePlace(now, before) || (!same && (specular || lit)) || now.image != before.image) h.frames = 0.0;
    if (same) return 1.0;
    const float luminanceBefore = luminance(h.mean);
    h.mean *= now.radiance * perAlbedo(before.radiance);
    const float gain = safeDivide(luminance(h.mean), luminanceBefore);
    h.squares *= sqr(gain);
    return gain;
}

// Whether the light was not there in the last frame.
bool isNew(uint light) {
    light &= ~kEmitterSpecular;
    return frameFlag(kFrameChanged) && light < kEmitterInfinite && previousLight(light) == kNone;
}

// The test of framesBorneOut (test.comp), but emission is old or it is not. moments: of nine differences between this frame
// and history; `variance`: of a sample by history.
bool contradicted(vec3 moments, float variance) {
    const float difference2 = sqr(safeDivide(moments.y, moments.x));
    const float spread = safeDivide(moments.z, moments.x) - difference2;
    return difference2 * moments.x > sqr(kSigma) * max(spread, variance - 2.0 * difference2);
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint own = pixelIndex(pixel);

    float samples[9];
    bool specular = false;
    bool passes = false; // something that is seen directly moves here, before what emits or not
    float brightest = -1.0;
    VisibleEmitter emitter = VisibleEmitter(kEmitterNone, vec2(0.0)); // of the brightest sample
    for (int i = 0; i < 9; ++i) {
        const ivec2 near = ivec2(pixel) + ivec2(i % 3 - 1, i / 3 - 1);
        samples[i] = -1.0;
        if (!insideView(near)) continue;
        const uint index = pixelIndex(near);
        vec3 radiance = push.emission.v[index];
        if (!isSound(radiance)) radiance = vec3(0.0);
        samples[i] = luminance(radiance);
        const VisibleEmitter seen = push.emitters.v[index];
        const bool turned = (seen.light & kEmitterSpecular) != 0u;
        passes = passes || (!turned && length(seen.motion) > kStill);
        if (i != 4 && !(samples[i] > 0.0)) continue;
        specular = specular || turned;
        if (samples[i] > brightest) {
            brightest = samples[i];
            emitter = seen;
        }
    }

    DenoiseEmission h = DenoiseEmission(vec3(0.0), 0.0, kNotKept, kEmitterNone);
    // Resampling smears outlines, and what glass shows moves otherwise than straight behind it: what moved is followed
    // within bright areas that are seen through glass. The pixel's own sample has no say: that would be a bias.
    const bool moved = (push.flags & kDenoiseCameraStill) == 0u || length(emitter.motion) > kStill;
    int bright = 0;
    for (int i = 0; i < 9; ++i) bright += i != 4 && samples[i] > 0.5 * brightest ? 1 : 0;
    const bool far = any(greaterThan(abs(emitter.motion), vec2(TL_FRAME.width, TL_FRAME.height)));
    if ((passes && !specular) || (moved && (!specular || bright < kMost || far))) {
        push.histories.v[own] = h;
        return;
    }
    h.frames = 0.0;
    const DenoiseEmission before = push.previous.v[own];
    if (!moved && brightest <= 0.0 && before.mean == vec3(0.0)) { // dark, and was
        // It says nothing of lamps that were not there.
        const float frames = frameFlag(kFrameLightsRenumbered) ? 0.0 : before.frames;
        push.histories.v[own] = DenoiseEmission(vec3(0.0), 0.0, frames, kEmitterNone);
        return;
    }

    const vec2 from = vec2(pixel) - emitter.motion;
    float total = 0.0;
    float lightWeight = 0.0;
    for (int i = 0; i < 9; ++i) {
        const ivec2 tap = ivec2(round(from)) + ivec2(i % 3 - 1, i / 3 - 1);
        if (!insideView(tap)) continue;
        const DenoiseEmission then = push.previous.v[pixelIndex(tap)];
        const vec2 overlap = max(1.0 - abs(vec2(tap) - from), 0.0);
        const float weight = overlap.x * overlap.y;
        total += weight;
        h.mean += weight * then.mean;
        h.squares += weight * then.squares;
        h.frames += weight * then.frames;
        if (weight > lightWeight && then.light != kEmitterNone) {
            lightWeight = weight;
            h.light = then.light;
        }
    }
    const float share = safeDivide(1.0, total);
    h.mean *= share;
    h.squares *= share;
    h.frames *= share;
    const uint light = h.light;
    const float gain = relight(h, specular);
    if (isNew(emitter.light)) h.frames = 0.0;

    vec4 sums = vec4(0.0); // pixels; how this frame differs from history, its square, its variance by history
    for (int i = 0; i < 9; ++i) {
        const ivec2 tap = ivec2(round(from)) + ivec2(i % 3 - 1, i / 3 - 1);
        if (!insideView(tap) || samples[i] < 0.0) continue;
        const DenoiseEmission then = push.previous.v[pixelIndex(tap)];
        const float relit = then.light == light ? gain : 1.0;
        const float mean = relit * luminance(then.mean);
        const float d = samples[i] - mean;
        sums += vec4(1.0, d, sqr(d), max(sqr(relit) * then.squares - sqr(mean), 0.0));
    }

    // Against the neighbourhood's history; within bright areas also against its own, which may be the only one left by the
    // last change. Of thin things and rare reflections the second test would keep dark histories and drop bright ones.
    const float mean = luminance(h.mean);
    vec3 moments = vec3(0.0);
    for (int i = 0; i < 9; ++i)
        if (samples[i] >= 0.0) moments += vec3(1.0, samples[i] - mean, sqr(samples[i] - mean));
    if (contradicted(sums.xyz, safeDivide(sums.w, sums.x)) ||
        (bright >= kMost && h.frames >= kSettled && contradicted(moments, max(h.squares - sqr(mean), 0.0))))
        h.frames = 0.0;
    if (moved) h.frames = min(h.frames, kMovingFrames - 1.0);
    push.histories.v[own] = h;
}
