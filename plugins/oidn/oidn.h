#pragma once

#include "plugin/registry.h"

namespace trilume {

/// The image filter `oidn`: Open Image Denoise on the CPU. Loads its library; throws inputError where there is none.
ImageFilter makeOidnFilter();

} // namespace trilume
