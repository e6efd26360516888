#include "gpu/result.h"

#include "core/error.h"

#include <fmt/core.h>

namespace trilume::gpu {

void check(VkResult result, std::string_view call) {
    if (result >= 0) return;
    switch (result) {
    case VK_ERROR_DEVICE_LOST:
        throw runError("the device was lost", std::string(call),
                       "a shader may have run too long or touched bad memory: try fewer pixels, or --device cpu, and "
                       "run with TRILUME_VALIDATION=1");
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        throw runError("out of host memory", std::string(call), "free some memory");
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        throw runError("out of device memory", std::string(call), "close other programs that use the device");
    default:
        throw runError(fmt::format("Vulkan error {}", static_cast<int>(result)), std::string(call),
                       "update the driver, or run with TRILUME_VALIDATION=1 for the cause");
    }
}

} // namespace trilume::gpu
