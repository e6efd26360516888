#pragma once

#include <vulkan/vulkan.h>

#include <string_view>

namespace trilume::gpu {

/// Throws runError unless `result` is a success: `call` is what was tried, e.g. "vkQueueSubmit2".
/// A lost device gets its own message with what to do about it.
void check(VkResult result, std::string_view call);

} // namespace trilume::gpu
