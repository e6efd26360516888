#pragma once

#include "graph/graph.h"

#include <array>
#include <optional>

namespace trilume::graph {

/// One node of a technique, in frame order.
struct GraphNode {
    std::string name;
    Node* node = nullptr;
    bool enabled = true; ///< false: the user switched it off
};

struct CompileInput {
    std::span<const GraphNode> nodes;
    const SceneFacts& facts;
    const ParamSet& params;
    uint32_t width = 0, height = 0;       ///< of the view, in pixels
    std::span<const std::string> outputs; ///< resources that the application reads after the frame
    bool overlapping = false;             ///< path classes may have several owners: their light counts several times
};

enum class PassState {
    Run,
    NotNeeded, ///< its own answer to the scene's facts
    Disabled,  ///< by the user
    Unused,    ///< nothing that runs reads what it makes
};

enum class HazardKind { ReadAfterWrite, WriteAfterRead, WriteAfterWrite };
const char* hazardName(HazardKind kind);

/// Why a pass must wait. `behind` is `resource` itself, or one whose memory it takes over.
struct Hazard {
    HazardKind kind;
    uint32_t resource;
    uint32_t behind;
    uint32_t pass; ///< the earlier pass that it waits for
};

struct Access {
    uint32_t resource;
    bool reads = false, writes = false;
};

struct Pass {
    std::string name;
    PassState state = PassState::Run;
    std::string reason; ///< why it does not run
    std::vector<Access> accesses;
    std::vector<Hazard> barrierBefore; ///< empty: no barrier
    bool runs() const { return state == PassState::Run; }
};

enum class ResourceKind { Plane, Buffer };
enum class HistoryRole {
    None,
    Current,
    Previous,
    Persistent, ///< a single copy, updated in place
};

/// One resource. Handle::resource is its index. A history pair takes two, `previous` right behind `current`.
struct ResourceInfo {
    std::string name;
    ResourceKind kind = ResourceKind::Plane;
    HistoryRole role = HistoryRole::None;
    size_t bytes = 0;
    uint32_t bytesPerPixel = 0; ///< planes only
    bool used = false;          ///< by a pass that runs; others have no memory
    bool output = false;        ///< lives past the last pass
    uint32_t firstUse = 0;      ///< pass indices, inclusive; an output's lastUse is passes.size()
    uint32_t lastUse = 0;
    size_t offset = 0; ///< in the arena; history has memory of its own
};

/// Plain data: what the executor records, the tests compare and the dumps show.
struct CompiledGraph {
    uint32_t width = 0, height = 0;
    std::vector<Pass> passes; ///< one for each node of the input, in order
    std::vector<ResourceInfo> resources;
    size_t arenaBytes = 0;
    size_t historyBytes = 0;
    std::array<std::optional<uint32_t>, static_cast<size_t>(PathClass::Count)> owners; ///< pass of each path class
    std::vector<PathClass> unowned;                                                    ///< light that is left out
    std::vector<PathClass> unneeded;         ///< without an owner either: the scene has no such light, says the node
    std::vector<std::string> missingOutputs; ///< asked for, but made by no node

    /// The resource of that name that a running pass uses; null when there is none.
    const ResourceInfo* find(std::string_view name) const;
};

/// Asks every enabled node whether it is needed, lets the needed ones declare from top to bottom, culls what nothing
/// uses, places transient resources in one arena and finds the barriers. No Vulkan calls; takes microseconds, so it can
/// run each frame. Throws one Error that names node and resource: Fault::Input when the user's choice of nodes is the
/// cause (two owners of a path class, a disabled node's resource), Fault::Run when a node's declaration is wrong.
CompiledGraph compile(const CompileInput& input);

} // namespace trilume::graph
