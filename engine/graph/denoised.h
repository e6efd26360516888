#pragma once

#include "params/params.h"

namespace trilume::graph {

/// Whether a denoiser averages the view's frames: it tells noise by how much they differ, so that other nodes do not
/// average, and asks what emission came from.
inline bool denoised(const ParamSet& params) {
    return params.table().find("denoise.mode") && params.getChoice("denoise.mode") == "temporal";
}

} // namespace trilume::graph
