// Shared structs are written once and compiled by C++ and GLSL alike, in scalar layout. tests/layout compares every
// member's SPIR-V offset with offsetof. Included by every header of this folder.
#ifndef TL_SHARED_TYPES_H
#define TL_SHARED_TYPES_H

#ifdef __cplusplus

#include <cstdint>
#include <glm/glm.hpp>

namespace trilume::shared {
using glm::ivec2;
using glm::ivec3;
using glm::mat3;
using glm::mat4;
using glm::mat4x3;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using uint = uint32_t;
} // namespace trilume::shared

// A device address; in GLSL a reference to an array of T, used as `ref.v[i]`.
#define TL_REF(T) uint64_t
#define TL_DECLARE_REF(T)
#define TL_DECLARE_ALIGNED_REF(T, alignment) static_assert(sizeof(T) % (alignment) == 0);
#define TL_BEGIN namespace trilume::shared {
#define TL_END }
#define TL_CONST static constexpr
#define TL_INLINE inline

#else

#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require

#define TL_REF(T) T##Ref
// Arrays start at multiples of 256 bytes. Elements that hold references need alignment 8 (Vulkan's rule for loads), and
// drivers load wider words where they may rely on more.
#define TL_DECLARE_ALIGNED_REF(T, alignment)                                                                           \
    layout(buffer_reference, scalar, buffer_reference_align = alignment) buffer T##Ref { T v[]; };
#define TL_DECLARE_REF(T) TL_DECLARE_ALIGNED_REF(T, 4)
#define TL_BEGIN
#define TL_END
#define TL_CONST const
#define TL_INLINE

#endif

TL_BEGIN
TL_DECLARE_REF(uint)
TL_DECLARE_REF(float)
TL_DECLARE_REF(vec2)
TL_DECLARE_REF(vec3)
TL_DECLARE_REF(vec4)
TL_DECLARE_REF(uvec2)
TL_DECLARE_REF(uvec3)
TL_DECLARE_REF(uvec4)
TL_END

#endif
