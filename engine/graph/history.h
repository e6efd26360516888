#pragma once

#include "graph/compile.h"

#include <map>

namespace trilume::graph {

/// Which half of each history pair is written this frame, and whether the other half holds last frame's data.
/// No GPU: memory belongs to the executor.
class HistoryTracker {
public:
    /// Follows a new graph. A pair lives on when its name, element size and count are unchanged, whatever else the
    /// graph changed; one that the graph lacks is forgotten, so its data is not valid when it returns.
    void adopt(const CompiledGraph& graph);
    /// Swaps the halves: what the last completed frame wrote becomes `previous`.
    void beginFrame();
    /// Every writer of the graph has been recorded. A frame that does not get here leaves its history invalid.
    void endFrame();
    /// Forgets all data.
    void reset();

    /// 0 or 1: the half that `name` (the pair's name) writes in this frame.
    uint32_t currentHalf(std::string_view name) const { return pairs_.find(name)->second.half; }
    /// Whether the other half holds last frame's data.
    bool valid(std::string_view name) const { return pairs_.find(name)->second.valid; }

private:
    struct Pair {
        ResourceKind kind;
        size_t bytes;
        uint32_t width, height; // 0 for buffers: they don't depend on the size of the view
        uint32_t half = 0;
        bool written = false, valid = false;
        bool sameShape(const Pair& other) const {
            return kind == other.kind && bytes == other.bytes && width == other.width && height == other.height;
        }
    };
    std::map<std::string, Pair, std::less<>> pairs_;
};

} // namespace trilume::graph
