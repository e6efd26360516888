#pragma once

#include "graph/compile.h"
#include "graph/history.h"

#include <array>
#include <map>

namespace trilume::graph {

/// What a frame brings to its nodes beside their resources; see FrameContext.
struct FrameInput {
    std::span<const GraphNode> nodes; ///< those that the graph was compiled from
    const ParamSet& params;
    const SceneFacts& facts;
    VkDeviceAddress frame = 0;
    uint32_t sampleIndex = 0;
    bool repeats = false;
    std::function<const gpu::Pipeline&(const gpu::ShaderSource&)> pipeline;
    uint32_t firstTimestamp = 0; ///< slots firstTimestamp .. firstTimestamp + passes that run are written
};

/// Owns the memory of one view's resources and records its compiled graph. Memory is not cleared: a node writes what it
/// creates before anyone reads it, and reads history only where it is valid.
class GraphExecutor {
public:
    explicit GraphExecutor(gpu::Device& device) : device_(device) {}

    /// Takes a new graph before the next frame. Memory is reallocated only where sizes changed, and history lives on
    /// in pairs that kept name and size. Throws runError when the device has no memory left; the graph before stays.
    void setGraph(CompiledGraph graph);
    const CompiledGraph& graph() const { return graph_; }

    /// Records one frame: barriers, nodes in order, timestamps. On return, outputs are visible to what is recorded
    /// next.
    void record(gpu::Commands& commands, const FrameInput& input);
    /// Executes the nodes as in a first frame without recording anything, for the pipelines that they ask for. Forgets
    /// history.
    void rehearse(const FrameInput& input);

    /// GPU milliseconds of each pass of the graph (0 for those that don't run), from the device's timestamps for the
    /// submission of the last record call. Passes without a barrier between them overlap: the later shows the rest.
    std::vector<double> passTimes(std::span<const double> timestamps) const;

    /// Makes all history invalid in the next frame: a camera cut, another scene, a parameter that resets history.
    void resetHistory() { history_.reset(); }

    /// Where a resource stands, after record: outputs keep their contents until the next frame is recorded.
    struct Region {
        const gpu::Buffer* buffer = nullptr; ///< null: no such resource in the graph
        size_t offset = 0, bytes = 0;
        explicit operator bool() const { return buffer != nullptr; }
        VkDeviceAddress address() const { return buffer->address() + offset; }
    };
    Region region(std::string_view name) const;

    /// Bytes of device memory held.
    size_t memoryBytes() const;

private:
    using Halves = std::array<gpu::Buffer, 2>;

    Region region(const ResourceInfo& resource) const;
    void execute(gpu::Commands& commands, const FrameInput& input);

    gpu::Device& device_;
    CompiledGraph graph_;
    gpu::Buffer arena_;
    std::map<std::string, Halves, std::less<>> historyMemory_;
    HistoryTracker history_;
    uint32_t firstTimestamp_ = 0;
};

} // namespace trilume::graph
