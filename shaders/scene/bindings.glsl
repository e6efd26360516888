// The only owner of the scene's bindings. A pass declares its push-constant block as `push`, whose first member is
// `FrameConstantsRef frame`, before it includes anything of scene/.
#ifndef TL_SCENE_BINDINGS_GLSL
#define TL_SCENE_BINDINGS_GLSL

#extension GL_EXT_nonuniform_qualifier : require

#include "shared/frame.h"

#define TL_FRAME push.frame.v[0]
#ifdef TL_LAST_FRAME // the pass looks at the scene as it was
#define TL_SCENE push.frame.v[0].previousScene.v[0]
#else
#define TL_SCENE push.frame.v[0].scene
#endif
#define TL_BSDF_TABLES push.frame.v[0].bsdfTables

layout(set = 0, binding = 0) uniform sampler2D textures[];

// st (0,0) is the lower left corner; images are stored from the top row down.
vec4 sampleTexture(uint image, vec2 st, float lod) {
    return textureLod(textures[nonuniformEXT(image)], vec2(st.x, 1.0 - st.y), lod);
}

#define TL_SAMPLE_TEXTURE(image, st) sampleTexture(image, st, 0.0).rgb

#endif
