#pragma once

#include "core/version.h"
#include "plugin/registry.h"
#include "trilume/plugin.h"

/// Defines both entry points. `registerFunction` is `void f(trilume::Registry&)`; an exception declines the plugin.
#define TL_PLUGIN(pluginName, registerFunction)                                                                        \
    extern "C" TL_PLUGIN_EXPORT const TlPluginInfo* tlPluginQuery(void) {                                              \
        static const TlPluginInfo info{sizeof(TlPluginInfo), TL_PLUGIN_ABI, pluginName, TRILUME_VERSION,               \
                                       TL_PLUGIN_BUILD_TAG};                                                           \
        return &info;                                                                                                  \
    }                                                                                                                  \
    extern "C" TL_PLUGIN_EXPORT int tlPluginRegister(TlRegistry* registry) {                                           \
        auto& host = *reinterpret_cast<trilume::Registry*>(registry);                                                  \
        try {                                                                                                          \
            registerFunction(host);                                                                                    \
            return 0;                                                                                                  \
        } catch (const std::exception& e) {                                                                            \
            host.refuse(e.what());                                                                                     \
            return 1;                                                                                                  \
        }                                                                                                              \
    }
