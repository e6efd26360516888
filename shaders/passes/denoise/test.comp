// Shortens history where a neighbourhood of this frame contradicts it. Each level sums nine neighbourhoods of the level
// before, three times as far apart: squares of 3, 9 and 27 pixels, no pixel counted twice.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "passes/denoise/sum.glsl"

const float kFewest = 5.0; // pixels for a test

// Frames that the history is worth. As an estimate of present radiance it has the error V / n + b^2: its noise, and the
// change b. A mean of n' frames has the same error for V / n' = V / n + b^2. The neighbourhood's mean difference d
// estimates b, less what noise explains: b^2 = d^2 - k^2 V / M. V is the larger of the differences' spread and the
// history's own: bright samples that are rare, and missed by this frame, are no change. Of a history that saw a change,
// part of the variance is that change: up to 2 d^2 do not count as noise.
float framesBorneOut(float frames, vec4 sums) {
    const float mean = sums.y / sums.x;
    const float variance = max(sums.z / sums.x - sqr(mean), sums.w / sums.x - 2.0 * sqr(mean));
    const float noise = sqr(push.changeSigma) * variance / sums.x;
    if (!(sqr(mean) > noise)) return frames;
    return 1.0 / (1.0 / frames + (sqr(mean) - noise) / variance);
}

void finish(uint signal, uint index, vec4 sums) {
    push.to[signal].v[index] = sums;
    const float frames = push.histories[signal].v[index].frames;
    if (sums.x >= kFewest && frames > 0.0) push.histories[signal].v[index].frames = framesBorneOut(frames, sums);
}
