/* The plugin ABI of Trilume. A plugin is a shared library beside a plugin.json, exporting the two functions below.
 * The loader calls tlPluginQuery first, which has no side effects, and declines a library whose ABI, struct size or
 * build tag differs from its own, with a reason. */
#ifndef TRILUME_PLUGIN_H
#define TRILUME_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TL_PLUGIN_ABI 2u

#if defined(__GNUC__)
#define TL_PLUGIN_EXPORT __attribute__((visibility("default")))
#else
#define TL_PLUGIN_EXPORT
#endif

typedef struct TlPluginInfo {
    uint32_t structSize; /* sizeof(TlPluginInfo) of the plugin's build */
    uint32_t abi;        /* TL_PLUGIN_ABI of the plugin's build */
    const char* name;
    const char* version;
    const char*
        buildTag; /* TL_PLUGIN_BUILD_TAG: engine version, compiler and C++ library; C++ types cross the border */
} TlPluginInfo;

/* Opaque here; trilume::Registry of the engine that loads. */
typedef struct TlRegistry TlRegistry;

TL_PLUGIN_EXPORT const TlPluginInfo* tlPluginQuery(void);
/* Returns 0, or non-zero when the plugin can't serve (the loader then reports it as declined). */
TL_PLUGIN_EXPORT int tlPluginRegister(TlRegistry* registry);

#ifdef __cplusplus
}
#endif

#endif
