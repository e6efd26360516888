#include "gpu/adapter.h"

#include "core/error.h"
#include "core/log.h"
#include "gpu/result.h"
#include "gpu/shader_object_extension.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

namespace trilume::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

// ---- Features --------------------------------------------------------------------------------------

template<class Struct>
struct Feature {
    const char* name;
    VkBool32 Struct::*flag;
};

using Features12 = VkPhysicalDeviceVulkan12Features;
using Features13 = VkPhysicalDeviceVulkan13Features;

constexpr Feature<Features12> kRequired12[] = {
    {"bufferDeviceAddress", &Features12::bufferDeviceAddress},
    {"scalarBlockLayout", &Features12::scalarBlockLayout},
    {"timelineSemaphore", &Features12::timelineSemaphore},
    {"hostQueryReset", &Features12::hostQueryReset},
    {"runtimeDescriptorArray", &Features12::runtimeDescriptorArray},
    {"descriptorBindingPartiallyBound", &Features12::descriptorBindingPartiallyBound},
    {"descriptorBindingSampledImageUpdateAfterBind", &Features12::descriptorBindingSampledImageUpdateAfterBind},
    {"shaderSampledImageArrayNonUniformIndexing", &Features12::shaderSampledImageArrayNonUniformIndexing},
};
constexpr Feature<Features13> kRequired13[] = {
    {"synchronization2", &Features13::synchronization2},
    {"maintenance4", &Features13::maintenance4},
};
constexpr const char* kRayQueryExtensions[] = {VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
                                               VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME,
                                               VK_KHR_RAY_QUERY_EXTENSION_NAME};

/// The feature structs of interest, chained; immovable because of the chain.
struct FeatureChain {
    VkPhysicalDeviceFeatures2 base{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
    Features12 v12{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    Features13 v13{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceAccelerationStructureFeaturesKHR accelerationStructure{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR};
    VkPhysicalDeviceRayQueryFeaturesKHR rayQuery{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR};
    VkPhysicalDeviceShaderObjectFeaturesEXT shaderObject{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_OBJECT_FEATURES_EXT};

    FeatureChain(bool withRayQuery, bool withShaderObject) {
        base.pNext = &v12;
        v12.pNext = &v13;
        if (withRayQuery) {
            v13.pNext = &accelerationStructure;
            accelerationStructure.pNext = &rayQuery;
        }
        if (withShaderObject) {
            shaderObject.pNext = v13.pNext;
            v13.pNext = &shaderObject;
        }
    }
    FeatureChain(const FeatureChain&) = delete;
    FeatureChain& operator=(const FeatureChain&) = delete;
};

const char* typeName(VkPhysicalDeviceType type) {
    switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
        return "cpu";
    default:
        return "other";
    }
}

std::optional<uint32_t> findComputeQueue(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    for (uint32_t i = 0; i < count; ++i)
        if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) && families[i].timestampValidBits > 0) return i;
    return std::nullopt;
}

std::vector<VkExtensionProperties> deviceExtensions(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
    return extensions;
}

Adapter describe(VkPhysicalDevice handle, uint32_t index) {
    Adapter adapter{.handle = handle};
    adapter.info.index = index;

    vkGetPhysicalDeviceProperties(handle, &adapter.properties);
    adapter.info.name = adapter.properties.deviceName;
    adapter.info.type = typeName(adapter.properties.deviceType);
    if (adapter.properties.apiVersion < VK_API_VERSION_1_3) {
        adapter.info.missing = "Vulkan 1.3";
        return adapter;
    }

    VkPhysicalDeviceMaintenance4Properties limits4{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES};
    VkPhysicalDeviceMaintenance3Properties limits3{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES,
                                                   &limits4};
    VkPhysicalDeviceSubgroupProperties subgroups{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES, &limits3};
    VkPhysicalDeviceIDProperties ids{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES, &subgroups};
    VkPhysicalDeviceDriverProperties driver{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES, &ids};
    VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver};
    vkGetPhysicalDeviceProperties2(handle, &properties);
    adapter.info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
    adapter.maxAllocation = std::min(limits3.maxMemoryAllocationSize, limits4.maxBufferSize);
    std::memcpy(adapter.driverUuid, ids.driverUUID, VK_UUID_SIZE);

    const auto queue = findComputeQueue(handle);
    if (!queue) {
        adapter.info.missing = "a compute queue with timestamps";
        return adapter;
    }
    adapter.queueFamily = *queue;

    const auto extensions = deviceExtensions(handle);
    const auto has = [&](const char* name) {
        return std::ranges::any_of(extensions, [name](const auto& e) { return !std::strcmp(e.extensionName, name); });
    };
    const bool rayExtensions = std::ranges::all_of(kRayQueryExtensions, has);
    const bool shaderObjects = has(VK_EXT_SHADER_OBJECT_EXTENSION_NAME);
    FeatureChain features(rayExtensions, shaderObjects);
    vkGetPhysicalDeviceFeatures2(handle, &features.base);
    adapter.info.rayQuery =
        rayExtensions && features.accelerationStructure.accelerationStructure && features.rayQuery.rayQuery;
    adapter.int64 = features.base.features.shaderInt64;
    adapter.memoryBudget = has(VK_EXT_MEMORY_BUDGET_EXTENSION_NAME);
    const bool software = adapter.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    adapter.keepsShaders = software && shaderObjects && features.shaderObject.shaderObject;

    const auto note = [&](const auto& required, const auto& present) {
        for (const auto& feature : required)
            if (adapter.info.missing.empty() && !(present.*feature.flag)) adapter.info.missing = feature.name;
    };
    note(kRequired12, features.v12);
    note(kRequired13, features.v13);
    constexpr VkSubgroupFeatureFlags kSubgroups = VK_SUBGROUP_FEATURE_ARITHMETIC_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;
    if (adapter.info.missing.empty() && (subgroups.supportedOperations & kSubgroups) != kSubgroups)
        adapter.info.missing = "subgroup arithmetic and ballot";
    return adapter;
}

std::string lower(std::string_view text) {
    std::string result(text);
    std::ranges::transform(result, result.begin(), [](unsigned char c) { return std::tolower(c); });
    return result;
}

std::string listOf(const std::vector<DeviceInfo>& devices) {
    std::string list;
    for (const DeviceInfo& device : devices)
        list += fmt::format("{}{} {} ({})", list.empty() ? "" : ", ", device.index, device.name, device.type);
    return list;
}

size_t chooseAutomatically(const std::vector<DeviceInfo>& devices) {
    for (const char* type : {"discrete", "integrated", "virtual", "cpu", "other"})
        for (size_t i = 0; i < devices.size(); ++i)
            if (devices[i].type == type && devices[i].missing.empty()) return i;
    return 0; // none is usable: say what the first one lacks
}

} // namespace

// ---- Instance --------------------------------------------------------------------------------------

Instance::Instance(bool validation) {
    VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.pEngineName = "Trilume";
    application.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pApplicationInfo = &application;

    const VkValidationFeatureEnableEXT synchronization = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkDebugUtilsMessengerCreateInfoEXT messenger{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = onMessage;
    messenger.pUserData = this;
    VkValidationFeaturesEXT features{VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT, &messenger};
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = &synchronization;
    const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    if (validation) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kValidationLayer;
        info.enabledExtensionCount = std::size(extensions);
        info.ppEnabledExtensionNames = extensions;
    }

    const VkResult result = vkCreateInstance(&info, nullptr, &handle_);
    if (result == VK_ERROR_LAYER_NOT_PRESENT)
        throw inputError("validation was asked for but its layer is not installed", kValidationLayer,
                         "install the package vulkan-validationlayers, or turn validation off");
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
        throw inputError("no Vulkan driver found", "Vulkan loader",
                         "install one, such as the package mesa-vulkan-drivers, or set VK_ICD_FILENAMES");
    check(result, "vkCreateInstance");

    if (validation) {
        const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(handle_, "vkCreateDebugUtilsMessengerEXT"));
        check(create(handle_, &messenger, nullptr, &messenger_), "vkCreateDebugUtilsMessengerEXT");
    }
}

Instance::~Instance() {
    if (messenger_) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(handle_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(handle_, messenger_, nullptr);
    }
    vkDestroyInstance(handle_, nullptr);
}

VkBool32 Instance::onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT severity, VkDebugUtilsMessageTypeFlagsEXT,
                             const VkDebugUtilsMessengerCallbackDataEXT* data, void* self) {
    ++static_cast<Instance*>(self)->messages_;
    const bool error = severity >= VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    log::write(error ? log::Level::Error : log::Level::Warning, fmt::format("validation: {}", data->pMessage));
    return VK_FALSE;
}

// ---- Devices ---------------------------------------------------------------------------------------

std::vector<Adapter> listAdapters(VkInstance instance) {
    uint32_t count = 0;
    check(vkEnumeratePhysicalDevices(instance, &count, nullptr), "vkEnumeratePhysicalDevices");
    std::vector<VkPhysicalDevice> handles(count);
    check(vkEnumeratePhysicalDevices(instance, &count, handles.data()), "vkEnumeratePhysicalDevices");
    std::vector<Adapter> adapters;
    for (uint32_t i = 0; i < count; ++i) adapters.push_back(describe(handles[i], i));
    return adapters;
}

std::vector<DeviceInfo> listDevices() {
    try {
        const Instance instance(false);
        std::vector<DeviceInfo> devices;
        for (Adapter& adapter : listAdapters(instance.handle())) devices.push_back(std::move(adapter.info));
        return devices;
    } catch (const Error& error) {
        log::debug("{}", error.what());
        return {};
    }
}

size_t chooseDevice(const std::vector<DeviceInfo>& devices, std::string_view choice) {
    if (devices.empty())
        throw inputError("no Vulkan device found", "Vulkan loader",
                         "install a driver, such as the package mesa-vulkan-drivers, or set VK_ICD_FILENAMES");

    size_t chosen = devices.size();
    uint32_t index = 0;
    const auto [end, error] = std::from_chars(choice.data(), choice.data() + choice.size(), index);
    if (choice == "auto") {
        chosen = chooseAutomatically(devices);
    } else if (error == std::errc() && end == choice.data() + choice.size()) {
        chosen = std::min<size_t>(index, devices.size());
    } else if (!choice.empty()) {
        const auto match = std::ranges::find_if(devices, [wanted = lower(choice)](const DeviceInfo& device) {
            return lower(device.name).find(wanted) != std::string::npos;
        });
        chosen = static_cast<size_t>(match - devices.begin());
    }
    if (chosen == devices.size())
        throw inputError(fmt::format("unknown device '{}'", choice), "device",
                         "choose auto, or an index or part of a name of: " + listOf(devices));
    if (!devices[chosen].missing.empty())
        throw inputError("the device lacks " + devices[chosen].missing, devices[chosen].name,
                         "update its driver, or choose another device of: " + listOf(devices));
    return chosen;
}

VkDevice createLogicalDevice(const Adapter& adapter) {
    FeatureChain features(adapter.info.rayQuery, adapter.keepsShaders);
    features.base.features.shaderInt64 = adapter.int64;
    for (const auto& feature : kRequired12) features.v12.*feature.flag = VK_TRUE;
    for (const auto& feature : kRequired13) features.v13.*feature.flag = VK_TRUE;
    std::vector<const char*> extensions;
    if (adapter.info.rayQuery) {
        features.accelerationStructure.accelerationStructure = VK_TRUE;
        features.rayQuery.rayQuery = VK_TRUE;
        extensions.assign(std::begin(kRayQueryExtensions), std::end(kRayQueryExtensions));
    }
    if (adapter.memoryBudget) extensions.push_back(VK_EXT_MEMORY_BUDGET_EXTENSION_NAME);
    if (adapter.keepsShaders) {
        features.shaderObject.shaderObject = VK_TRUE;
        extensions.push_back(VK_EXT_SHADER_OBJECT_EXTENSION_NAME);
    }

    const float priority = 1;
    VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue.queueFamilyIndex = adapter.queueFamily;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features.base};
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queue;
    info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    VkDevice device = VK_NULL_HANDLE;
    check(vkCreateDevice(adapter.handle, &info, nullptr, &device), "vkCreateDevice");
    return device;
}

} // namespace trilume::gpu
