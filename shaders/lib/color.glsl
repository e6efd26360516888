// Colours are linear Rec. 709 unless a name says otherwise.
#ifndef TL_LIB_COLOR_GLSL
#define TL_LIB_COLOR_GLSL

float luminance(vec3 rec709) { return dot(rec709, vec3(0.2126, 0.7152, 0.0722)); }
bool isBlack(vec3 c) { return c.x == 0.0 && c.y == 0.0 && c.z == 0.0; }

// IEC 61966-2-1.
vec3 srgbFromLinear(vec3 linear) {
    const vec3 c = clamp(linear, vec3(0.0), vec3(1.0));
    return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}
vec3 linearFromSrgb(vec3 srgb) {
    return mix(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92, lessThanEqual(srgb, vec3(0.04045)));
}

#endif
