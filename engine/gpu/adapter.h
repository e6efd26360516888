#pragma once

#include "gpu/device.h"

namespace trilume::gpu {

/// The Vulkan instance and, with validation, the counter of its messages.
class Instance {
public:
    /// Throws inputError when there is no Vulkan driver, or validation is asked for and not installed.
    explicit Instance(bool validation);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    VkInstance handle() const { return handle_; }
    bool validates() const { return messenger_ != VK_NULL_HANDLE; }
    uint32_t messages() const { return messages_; }

private:
    static VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                    VkDebugUtilsMessageTypeFlagsEXT types,
                                                    const VkDebugUtilsMessengerCallbackDataEXT* data, void* self);

    VkInstance handle_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    uint32_t messages_ = 0;
};

/// A physical device and what the engine asks of it.
struct Adapter {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    DeviceInfo info;
    VkPhysicalDeviceProperties properties{};
    uint64_t maxAllocation = 0; ///< bytes, of one allocation and of one buffer
    uint8_t driverUuid[VK_UUID_SIZE] = {};
    uint32_t queueFamily = 0;
    bool int64 = false;
    bool memoryBudget = false; ///< VK_EXT_memory_budget
    bool keepsShaders = false; ///< VK_EXT_shader_object is there and of use: see ShaderObjects
};

std::vector<Adapter> listAdapters(VkInstance instance);

/// Index into `devices` of the one that `choice` means (DeviceOptions::device).
/// Throws inputError, listing the devices when the choice is unknown, naming the feature when the device lacks one.
size_t chooseDevice(const std::vector<DeviceInfo>& devices, std::string_view choice);

/// Creates the logical device with every required feature, ray queries where there are, and one queue.
VkDevice createLogicalDevice(const Adapter& adapter);

} // namespace trilume::gpu
