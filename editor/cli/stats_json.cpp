#include "stats_json.h"

#include "core/version.h"

#include <nlohmann/json.hpp>

namespace trilume::cli {
namespace {

using Json = nlohmann::ordered_json;

Json frameJson(const RunStats::Frame& frame) {
    const FrameStats& s = frame.stats;
    Json nodes = Json::array();
    for (const NodeStats& node : s.nodes)
        nodes.push_back({{"name", node.name}, {"state", node.state}, {"reason", node.reason}, {"ms", node.ms}});
    return {
        {"frame", frame.frame},
        {"spp", s.spp},
        {"ms", s.ms},
        {"warmup_ms", s.warmupMs},
        {"host_ms", s.hostMs},
        {"nodes", nodes},
        {"rays", s.rays},
        {"accel", {{"blas_built", s.blasBuilt}, {"blas_refit", s.blasRefit}, {"tlas_built", s.tlasBuilt}}},
        {"uploaded_bytes", s.uploadedBytes},
        {"probes", {{"total", s.probes.total}, {"active", s.probes.active}, {"updated", s.probes.updated}}},
        {"photons", s.photons},
        {"nonfinite", s.nonfinite},
        {"memory_bytes", s.memoryBytes},
        {"effort", s.effort},
        {"unowned", s.unowned},
    };
}

} // namespace

const char* tracerName(gpu::Tracer tracer) {
    switch (tracer) {
    case gpu::Tracer::Auto:
        return "auto";
    case gpu::Tracer::Compute:
        return "compute";
    case gpu::Tracer::Query:
        return "query";
    }
    return "";
}

Json statsJson(const RunStats& stats) {
    Json frames = Json::array(), pipelines = Json::array();
    for (const RunStats::Frame& frame : stats.frames) frames.push_back(frameJson(frame));
    for (const gpu::PipelineCost& p : stats.startup.pipelines)
        pipelines.push_back(
            {{"name", p.name}, {"spirv_ms", p.spirvMs}, {"driver_ms", p.driverMs}, {"dispatch_ms", p.dispatchMs}});
    return {
        {"version", TRILUME_VERSION},
        {"device", {{"name", stats.device.name}, {"driver", stats.device.driver}, {"type", stats.device.type}}},
        {"tracer", tracerName(stats.tracer)},
        {"technique", stats.technique},
        {"stage", stats.stage},
        {"width", stats.width},
        {"height", stats.height},
        {"startup_ms",
         {{"device", stats.startup.deviceMs},
          {"load", stats.startup.loadMs},
          {"pipelines", stats.startup.pipelinesMs},
          {"first_frame", stats.startup.firstFrameMs}}},
        {"pipelines", pipelines},
        {"frames", frames},
    };
}

} // namespace trilume::cli
