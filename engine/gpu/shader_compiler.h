#pragma once

#include "gpu/device.h"

#include <filesystem>

namespace trilume::gpu {

/// SPIR-V of a compute shader and what the host must know of it.
struct ShaderModule {
    std::vector<uint32_t> spirv;
    uint32_t localSize[3] = {1, 1, 1};
    bool usesTopLevel = false; ///< declares an acceleration structure
};

/// Where shader paths and includes start: TRILUME_SHADERS, else <home>/share/trilume/shaders.
std::filesystem::path shaderRoot();

/// Compiles for Vulkan 1.3, or takes the result of an earlier compilation of the same text from the disk cache.
/// May be called by several threads at once. Throws inputError when the file or an include is missing, runError with
/// the compiler's first message.
ShaderModule compileShader(const ShaderSource& source);

} // namespace trilume::gpu
