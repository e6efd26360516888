// From last frame's useful flux to this frame's probabilities: one workgroup for each group of lights, a target for each
// thread at a time. Its first thread also says how many photons this frame emits.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "passes/caustics/push.glsl"

layout(local_size_x = kGuideCells) in;

const float kForget = 0.1;    // of what was learned, in each frame
const float kExplore = 0.1;   // share of all targets alike
const float kArrivals = 16.0; // photons wanted for each lit pixel: a relative error of 1/4
const uint kFewest = 8;       // the limit's part that is always emitted, to notice what changes

uint wholeCount() {
    if ((push.flags & kCausticsHistory) == 0u) return push.photonLimit;
    const CausticState before = push.previousState.v[0];
    if (before.emitted != before.whole) return min(before.whole, push.photonLimit); // too few to judge by
    const float emitted = float(before.emitted);
    const float wanted = kArrivals * emitted * safeDivide(float(before.lit), float(before.arrivals));
    return clamp(uint(clamp(wanted, 0.5 * emitted, 2.0 * emitted)), push.photonLimit / kFewest, push.photonLimit);
}

shared float partial[kGuideCells];

// Inclusive prefix sum over the workgroup.
float scan(float value) {
    const uint lane = gl_LocalInvocationIndex;
    partial[lane] = value;
    for (uint step = 1u; step < kGuideCells; step *= 2u) {
        barrier();
        const float below = lane >= step ? partial[lane - step] : 0.0;
        barrier();
        partial[lane] += below;
    }
    barrier();
    return partial[lane];
}

void main() {
    const uint lane = gl_LocalInvocationIndex;
    const uint first = gl_WorkGroupID.x * kGuideTargets + lane;
    const bool known = gl_WorkGroupID.x < push.knownGroups;
    float total = 0.0;
    for (uint caster = 0u; caster < TL_SCENE.casterCount; ++caster) {
        const uint target = first + caster * kGuideCells;
        float learned = 0.0;
        if (known && caster < push.knownCasters) {
            const GuideTarget before = push.previousGuide.v[target];
            const float flux = float(before.flux) / (float(kGuideUnit) * float(max(push.previousState.v[0].emitted, 1u)));
            learned = mix(before.learned, flux, kForget * push.share);
        }
        push.guide.v[target].learned = learned;
        push.guide.v[target].flux = 0u;
        total += learned;
    }
    scan(total);
    total = partial[kGuideCells - 1u];
    barrier();

    const float targets = float(TL_SCENE.casterCount * kGuideCells);
    float sum = 0.0;
    for (uint caster = 0u; caster < TL_SCENE.casterCount; ++caster) {
        const uint target = first + caster * kGuideCells;
        const float learned = total > 0.0 ? push.guide.v[target].learned / total : 1.0 / targets;
        push.guide.v[target].cumulative = sum + scan(mix(learned, 1.0 / targets, kExplore));
        sum += partial[kGuideCells - 1u];
        barrier();
    }
    if (gl_GlobalInvocationID.x == 0u) {
        const uint whole = wholeCount();
        const uint photons = max(uint(push.share * float(whole)), 1u);
        push.state.v[0] = CausticState(photons, whole, 0u, 0u);
        atomicAdd(TL_FRAME.counters.v[kCounterPhotons], photons);
    }
}
