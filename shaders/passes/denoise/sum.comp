// The first half of a square's sums: along the first axis.
#version 460
#extension GL_GOOGLE_include_directive : require

#define TL_FROM_HISTORY !TL_CHANGES
#include "passes/denoise/sum.glsl"

void finish(uint signal, uint index, vec4 sums) { push.to[signal].v[index] = sums; }
