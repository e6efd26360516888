// Stateless samples: each number is a function of (pixel, sample index, seed, dimension), so passes may run in any order.
#ifndef TL_LIB_RNG_GLSL
#define TL_LIB_RNG_GLSL

const uint kSamplerIndependent = 0;
const uint kSamplerSobol = 1; // Owen-scrambled Sobol pairs, padded

// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering": permutation of 32 bits, and 3 words to 3 words.
uint pcg(uint v) {
    const uint state = v * 747796405u + 2891336453u;
    const uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}
uvec3 pcg3d(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// The upper 24 bits as a float in [0, 1), exactly.
float unitFloat(uint bits) { return float(bits >> 8) * (1.0 / 16777216.0); }
vec2 unitFloat(uvec2 bits) { return vec2(bits >> 8) * (1.0 / 16777216.0); }

struct Sampler {
    uint key;       // of pixel and seed
    uint index;     // of the sample within the pixel; bit-reversed for Sobol
    uint dimension; // grows by one with each draw; set it to jump to a fixed place
    uint kind;
};

// Pixels below 65536 x 65536 get distinct keys for any seed.
Sampler samplerInit(uvec2 pixel, uint sampleIndex, uint seed, uint kind) {
    const uint key = pcg((pixel.x | (pixel.y << 16)) ^ pcg(seed));
    return Sampler(key, kind == kSamplerSobol ? bitfieldReverse(sampleIndex) : sampleIndex, 0u, kind);
}

// An Owen scramble of bit-reversed x: each bit is flipped by a hash of the bits below it. Laine & Karras 2011's
// construction with the constants that Vegdahl found by search (2021, "Building a Better LK Hash").
uint owenScrambleReversed(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Bit-reversed second dimension of the Sobol sequence. Its generator matrix is Pascal's triangle modulo 2; C(k, j) is odd
// where the bits of j are a subset of those of k, so the product is an XOR over supersets: five butterfly steps.
uint sobolSecondReversed(uint index) {
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    index ^= index >> 16;
    return index;
}

// Burley 2020, "Practical Hash-based Owen Scrambling": shuffle the index by an Owen scramble of its own for each pair of
// dimensions, take the first two Sobol dimensions (the first is the reversed index) and scramble each.
vec2 sample2D(inout Sampler s) {
    const uint dimension = s.dimension++;
    const uvec3 h = pcg3d(uvec3(s.key, dimension, s.kind == kSamplerSobol ? 0x9e3779b9u : s.index));
    if (s.kind != kSamplerSobol) return unitFloat(h.xy);
    const uint index = bitfieldReverse(owenScrambleReversed(s.index, h.z));
    return unitFloat(uvec2(bitfieldReverse(owenScrambleReversed(index, h.x)),
                           bitfieldReverse(owenScrambleReversed(sobolSecondReversed(index), h.y))));
}

// 32 bits, for choices among more alternatives than a float in [0, 1) tells apart.
uint sampleBits(inout Sampler s) {
    const uint dimension = s.dimension++;
    const uvec3 h = pcg3d(uvec3(s.key, dimension, s.kind == kSamplerSobol ? 0x9e3779b9u : s.index));
    if (s.kind != kSamplerSobol) return h.x;
    const uint index = bitfieldReverse(owenScrambleReversed(s.index, h.z));
    return bitfieldReverse(owenScrambleReversed(index, h.x));
}

float sample1D(inout Sampler s) { return unitFloat(sampleBits(s)); }

vec3 sample3D(inout Sampler s) {
    const vec2 uv = sample2D(s);
    return vec3(uv, sample1D(s));
}

#endif
