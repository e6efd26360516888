#pragma once

#include "render/renderer.h"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace trilume::cli {

/// What one `trilume render` did.
struct RunStats {
    gpu::DeviceInfo device;
    gpu::Tracer tracer = gpu::Tracer::Compute;
    std::string technique, stage;
    uint32_t width = 0, height = 0;
    StartupStats startup;
    struct Frame {
        double frame = 0; ///< time code
        FrameStats stats;
    };
    std::vector<Frame> frames;
};

/// The object that `--stats` writes, in the contract's order of keys.
nlohmann::ordered_json statsJson(const RunStats& stats);

const char* tracerName(gpu::Tracer tracer);

} // namespace trilume::cli
