// Adds this frame's sample to the history, which counts for as many frames as this frame's neighbourhood bears out.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/denoise.h"

layout(push_constant, scalar) uniform Push { DenoiseAccumulatePush push; };

#include "passes/denoise/common.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float kNeighbour = 0.5;      // likeness
const uint kFewestNeighbours = 8u; // for a test

bool sampleAt(uint index, out vec3 radiance) {
    radiance = push.signal.v[index];
    // Its square goes into the moments.
    const bool sound = isFinite(radiance) && isFinite(sqr(luminance(radiance)));
    if (!sound) radiance = vec3(0.0);
    return sound;
}

// Frames that the history is worth. Against the present radiance it has the error variance V / n + b^2: noise, and the
// change b since. An estimate of equal error has n' frames with V / n' = V / n + b^2. The neighbourhood's mean difference d
// between sample and history estimates b, less what noise explains: b^2 = d^2 - k^2 V / M. V is the larger of the spread
// of the differences and the history's own: bright samples that are rare and missed by this frame are no change.
float framesBorneOut(ivec2 pixel, DenoiseSurface p, float frames) {
    float count = 0.0;
    float sum = 0.0;
    float squares = 0.0;
    float variance = 0.0;
    for (int i = 0; i < 25; ++i) {
        const ivec2 tap = pixel + 2 * ivec2(i % 5 - 2, i / 5 - 2);
        if (!insideView(tap)) continue;
        const uint index = pixelIndex(tap);
        const DenoiseSurface q = push.surfaces.v[index];
        const DenoiseHistory expected = push.expected.v[index];
        const float albedo = luminance(q.albedo);
        if (!(albedo > 0.0) || expected.frames == 0.0 || likeness(p, q) < kNeighbour) continue;
        vec3 radiance;
        sampleAt(index, radiance);
        const float difference = (luminance(radiance) - luminance(expected.mean)) / albedo;
        count += 1.0;
        sum += difference;
        squares += sqr(difference);
        variance += frameVariance(expected) * (1.0 + 1.0 / expected.frames) / sqr(albedo);
    }
    if (count < float(kFewestNeighbours)) return frames;
    const float mean = sum / count;
    const float spread = max(squares / count - sqr(mean), variance / count);
    if (!(sqr(mean) > sqr(push.changeSigma) * spread / count)) return frames;
    return 1.0 / (safeDivide(sqr(mean), spread) - sqr(push.changeSigma) / count + 1.0 / frames);
}

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (!insideView(pixel)) return;
    const uint index = pixelIndex(pixel);
    vec3 radiance;
    if (!sampleAt(index, radiance)) atomicAdd(TL_FRAME.counters.v[kCounterNonfinite], 1u);

    DenoiseHistory h = push.expected.v[index];
    const DenoiseSurface p = push.surfaces.v[index];
    if ((push.flags & kDenoiseSceneChanged) != 0u && h.frames > 0.0 && p.chain != kNone)
        h.frames = framesBorneOut(ivec2(pixel), p, h.frames);
    h.frames = min(h.frames + 1.0, push.maxFrames);
    h.mean = mix(h.mean, radiance, 1.0 / h.frames);
    h.squares = mix(h.squares, sqr(luminance(radiance)), 1.0 / h.frames);
    push.history.v[index] = h;
}
