#pragma once

#include "trilume/plugin.h"

#include <filesystem>
#include <string_view>

namespace trilume {

using PluginRegisterFunction = int (*)(TlRegistry*);

/// Opens a plugin's library and lets tlPluginQuery prove that it is the plugin `name`, built for this engine.
/// Throws inputError with the reason, having closed the library, when it is not. Otherwise it stays loaded.
PluginRegisterFunction openPlugin(const std::filesystem::path& library, std::string_view name);

} // namespace trilume
