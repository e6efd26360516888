#include "graph/history.h"

namespace trilume::graph {

void HistoryTracker::adopt(const CompiledGraph& graph) {
    std::map<std::string, Pair, std::less<>> next;
    for (const ResourceInfo& resource : graph.resources) {
        const bool kept = resource.role == HistoryRole::Current || resource.role == HistoryRole::Persistent;
        if (!kept || !resource.used) continue;
        const bool plane = resource.kind == ResourceKind::Plane;
        Pair pair{.kind = resource.kind,
                  .bytes = resource.bytes,
                  .width = plane ? graph.width : 0,
                  .height = plane ? graph.height : 0};
        const auto known = pairs_.find(resource.name);
        next.emplace(resource.name, known != pairs_.end() && known->second.sameShape(pair) ? known->second : pair);
    }
    pairs_ = std::move(next);
}

void HistoryTracker::beginFrame() {
    for (auto& [name, pair] : pairs_) {
        pair.half ^= 1u;
        pair.valid = pair.written;
        pair.written = false;
    }
}

void HistoryTracker::endFrame() {
    for (auto& [name, pair] : pairs_) pair.written = true;
}

void HistoryTracker::reset() {
    for (auto& [name, pair] : pairs_) pair.written = pair.valid = false;
}

} // namespace trilume::graph
