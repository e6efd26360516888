#include "oidn.h"
#include "plugin/plugin_cpp.h"

static void registerPlugin(trilume::Registry& registry) { registry.addImageFilter("oidn", trilume::makeOidnFilter); }

TL_PLUGIN("oidn", registerPlugin)
