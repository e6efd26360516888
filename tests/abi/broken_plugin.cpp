// A plugin that is broken in the way that TL_BROKEN_<WAY> says.

#include "plugin/plugin_cpp.h"

#include <stdexcept>

#ifdef TL_BROKEN_SIZE
constexpr uint32_t kSize = sizeof(TlPluginInfo) + 8;
#else
constexpr uint32_t kSize = sizeof(TlPluginInfo);
#endif
#ifdef TL_BROKEN_ABI
constexpr uint32_t kAbi = TL_PLUGIN_ABI + 1;
#else
constexpr uint32_t kAbi = TL_PLUGIN_ABI;
#endif
#ifdef TL_BROKEN_TAG
constexpr const char* kTag = "0.0.1 another compiler";
#else
constexpr const char* kTag = TL_PLUGIN_BUILD_TAG;
#endif
#ifdef TL_BROKEN_NAME
constexpr const char* kName = "another";
#else
constexpr const char* kName = "broken";
#endif

#ifndef TL_BROKEN_QUERY
extern "C" TL_PLUGIN_EXPORT const TlPluginInfo* tlPluginQuery(void) {
    static const TlPluginInfo info{kSize, kAbi, kName, "1.0", kTag};
#ifdef TL_BROKEN_INFO
    return nullptr;
#endif
    return &info;
}
#endif

#ifdef TL_BROKEN_SYMBOL
void definedNowhere();
#endif

#ifndef TL_BROKEN_REGISTER
extern "C" TL_PLUGIN_EXPORT int tlPluginRegister(TlRegistry* registry) {
    auto& host = *reinterpret_cast<trilume::Registry*>(registry);
#ifdef TL_BROKEN_SYMBOL
    definedNowhere();
#endif
    host.addParam({.name = "broken.x", .defaultValue = true});
#ifdef TL_BROKEN_PARAM
    host.addParam({.name = "broken.y", .defaultValue = 5.0, .maximum = 1});
#endif
#ifndef TL_BROKEN_NODE
    host.addNode({"broken", "broken", nullptr});
#endif
#ifdef TL_BROKEN_THROW
    throw std::runtime_error("no licence found");
#endif
#ifdef TL_BROKEN_REFUSAL
    host.refuse("no camera attached");
    return 1;
#endif
#ifdef TL_BROKEN_RESULT
    return 7;
#endif
    return 0;
}
#endif
