/* The plugin header is C99. A plugin in C can't know the build tag, which names a C++ compiler; it is declined by it. */
#include "trilume/plugin.h"

static const TlPluginInfo kInfo = {sizeof(TlPluginInfo), TL_PLUGIN_ABI, "c99", "1.0", ""};

const TlPluginInfo* tlPluginQuery(void) { return &kInfo; }

int tlPluginRegister(TlRegistry* registry) { return registry ? 0 : 1; }
