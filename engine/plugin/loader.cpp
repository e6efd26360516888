#include "plugin/loader.h"

#include "core/error.h"
#include "core/version.h"

#include <dlfcn.h>
#include <fmt/core.h>

#include <memory>

namespace trilume {

namespace {

/// Closes the library unless it is released.
using Library = std::unique_ptr<void, decltype([](void* handle) { ::dlclose(handle); })>;

template<class Function>
Function symbol(const Library& library, const std::filesystem::path& path, const char* name) {
    if (void* address = ::dlsym(library.get(), name)) return reinterpret_cast<Function>(address);
    throw inputError(fmt::format("the library lacks {}", name), path.string(),
                     "define both entry points, in C++ by TL_PLUGIN of plugin/plugin_cpp.h");
}

/// Reads no member before the ones ahead of it have proved that it is there.
void checkInfo(const TlPluginInfo* info, const std::filesystem::path& path, std::string_view name) {
    const auto decline = [&](const std::string& what, const std::string& hint) {
        return inputError(what, path.string(), hint);
    };
    const std::string rebuild = "build the plugin against this engine's headers, with its compiler";
    if (!info) throw decline("tlPluginQuery returned null", "return a TlPluginInfo");
    if (info->structSize != sizeof(TlPluginInfo))
        throw decline(fmt::format("TlPluginInfo has {} bytes, the engine's {}", info->structSize, sizeof(TlPluginInfo)),
                      rebuild);
    if (info->abi != TL_PLUGIN_ABI)
        throw decline(fmt::format("plugin ABI {}, the engine's is {}", info->abi, TL_PLUGIN_ABI), rebuild);
    const std::string_view tag = info->buildTag ? info->buildTag : "";
    if (tag != TL_PLUGIN_BUILD_TAG)
        throw decline(fmt::format("built as \"{}\", the engine as \"{}\"", tag, TL_PLUGIN_BUILD_TAG), rebuild);
    const std::string_view said = info->name ? info->name : "";
    if (said != name)
        throw decline(fmt::format("the library says that it is \"{}\", plugin.json that it is \"{}\"", said, name),
                      "make the two names agree");
}

} // namespace

PluginRegisterFunction openPlugin(const std::filesystem::path& path, std::string_view name) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored))
        throw inputError("the plugin's library is missing", path.string(), "build or install the plugin again");
    // Local: the plugin's own dependencies must not replace symbols of the engine or of other plugins.
    Library library(::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL));
    if (!library) {
        const char* reason = ::dlerror();
        throw inputError("the plugin's library does not load", path.string(), reason ? reason : "unknown reason");
    }
    const auto query = symbol<const TlPluginInfo* (*)()>(library, path, "tlPluginQuery");
    const auto registerFunction = symbol<PluginRegisterFunction>(library, path, "tlPluginRegister");
    checkInfo(query(), path, name);
    (void)library.release(); // until the process ends; see Registry
    return registerFunction;
}

} // namespace trilume
