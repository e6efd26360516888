#include "graph/compile.h"

#include "core/error.h"
#include "graph/arena.h"
#include "graph/builder.h"

#include <fmt/core.h>

#include <algorithm>

namespace trilume::graph {

namespace {

/// A pass for each node, with what can be said before it declares anything.
std::vector<Pass> askNodes(const CompileInput& input) {
    std::vector<Pass> passes;
    for (const GraphNode& entry : input.nodes) {
        if (std::any_of(passes.begin(), passes.end(), [&](const Pass& p) { return p.name == entry.name; }))
            throw runError("a technique lists a node twice", entry.name, "list it once");
        Pass& pass = passes.emplace_back(Pass{.name = entry.name});
        if (!entry.enabled) {
            pass.state = PassState::Disabled;
            pass.reason = "disabled";
        } else {
            Need need = entry.node->needed(input.facts, input.params);
            if (!need.needed) pass.state = PassState::NotNeeded;
            pass.reason = std::move(need.reason);
        }
    }
    return passes;
}

/// Which passes have an effect that somebody sees: in an output, outside the graph, or in the next frame of one that
/// has.
std::vector<bool> findLive(const Recorder& recorder, std::span<const ResourceInfo> resources) {
    const std::vector<Declaration>& declarations = recorder.declarations();
    std::vector<bool> live(declarations.size());
    std::vector<uint32_t> work;
    const auto wake = [&](uint32_t pass) {
        if (!live[pass]) work.push_back(pass);
        live[pass] = true;
    };
    for (uint32_t pass = 0; pass < declarations.size(); ++pass)
        if (declarations[pass].sideEffect) wake(pass);
    for (uint32_t resource = 0; resource < resources.size(); ++resource)
        if (resources[resource].output) wake(recorder.lastProducer(resource));
    while (!work.empty()) {
        const uint32_t pass = work.back();
        work.pop_back();
        for (const VersionedAccess& access : declarations[pass].accesses) {
            if (access.before > 0) wake(recorder.producer(access.resource, access.before));
            // What is read as last frame's must be written to the end this frame.
            if (resources[access.resource].role == HistoryRole::Previous)
                wake(recorder.lastProducer(access.resource - 1));
        }
    }
    return live;
}

std::string whyUnused(const Recorder& recorder, std::span<const Pass> passes, std::span<const ResourceInfo> resources,
                      uint32_t pass) {
    const Declaration& declaration = recorder.declarations()[pass];
    const auto made = std::find_if(declaration.accesses.begin(), declaration.accesses.end(),
                                   [](const VersionedAccess& a) { return a.writes; });
    if (made == declaration.accesses.end()) {
        if (declaration.missing.empty()) return "unused: it makes nothing";
        const std::string& name = declaration.missing.front();
        return fmt::format("{} is missing: {}", name, recorder.whyMissing(name));
    }
    const std::string& name = resources[made->resource].name;
    for (uint32_t reader = pass + 1; reader < passes.size(); ++reader)
        for (const VersionedAccess& access : recorder.declarations()[reader].accesses)
            if (access.resource == made->resource)
                return fmt::format("unused: only {} uses {}, and it does not run", passes[reader].name, name);
    return fmt::format("unused: nothing reads {}", name);
}

void assignOwners(CompiledGraph& graph, std::span<const Declaration> declarations, bool overlapping) {
    for (uint32_t pass = 0; pass < graph.passes.size(); ++pass) {
        if (!graph.passes[pass].runs()) continue;
        for (const PathClass pathClass : declarations[pass].owned) {
            std::optional<uint32_t>& owner = graph.owners[static_cast<size_t>(pathClass)];
            if (owner && *owner != pass && !overlapping)
                throw inputError(fmt::format("two nodes own the {} light paths", pathClassName(pathClass)),
                                 fmt::format("{} and {}", graph.passes[*owner].name, graph.passes[pass].name),
                                 "they would be counted twice: disable one of the two");
            owner = pass;
        }
    }
    for (size_t i = 0; i < graph.owners.size(); ++i) {
        const auto pathClass = static_cast<PathClass>(i);
        const bool unneeded = std::count(graph.unneeded.begin(), graph.unneeded.end(), pathClass) > 0;
        if (!graph.owners[i] && !unneeded) graph.unowned.push_back(pathClass);
    }
    std::erase_if(graph.unneeded, [&](PathClass c) { return graph.owners[static_cast<size_t>(c)].has_value(); });
}

/// Path classes of the nodes that the scene doesn't need. They declare apart from the others: only what they would own
/// is of interest.
std::vector<PathClass> ownedByUnneeded(const CompileInput& input, const std::vector<Pass>& passes) {
    Recorder recorder(input, passes);
    std::vector<PathClass> owned;
    for (uint32_t pass = 0; pass < passes.size(); ++pass) {
        if (passes[pass].state != PassState::NotNeeded) continue;
        recorder.declare(pass, *input.nodes[pass].node);
        for (const PathClass c : recorder.declarations()[pass].owned)
            if (std::find(owned.begin(), owned.end(), c) == owned.end()) owned.push_back(c);
    }
    return owned;
}

void findLifetimes(CompiledGraph& graph) {
    for (uint32_t pass = 0; pass < graph.passes.size(); ++pass)
        for (const Access& access : graph.passes[pass].accesses) {
            ResourceInfo& resource = graph.resources[access.resource];
            if (!resource.used) resource.firstUse = pass;
            resource.used = true;
            resource.lastUse = pass;
        }
    for (ResourceInfo& resource : graph.resources)
        if (resource.output) resource.lastUse = static_cast<uint32_t>(graph.passes.size());
}

void placeResources(CompiledGraph& graph) {
    std::vector<Block> blocks;
    std::vector<ResourceInfo*> owners;
    for (ResourceInfo& resource : graph.resources) {
        if (!resource.used) continue;
        if (resource.role == HistoryRole::None) {
            blocks.push_back({.bytes = resource.bytes, .first = resource.firstUse, .last = resource.lastUse});
            owners.push_back(&resource);
        } else {
            graph.historyBytes += resource.bytes;
        }
    }
    graph.arenaBytes = placeInArena(blocks);
    for (size_t i = 0; i < blocks.size(); ++i) owners[i]->offset = blocks[i].offset;
}

bool shareMemory(const ResourceInfo& a, const ResourceInfo& b) {
    return a.role == HistoryRole::None && b.role == HistoryRole::None &&
           a.offset < b.offset + std::max<size_t>(b.bytes, 1) && b.offset < a.offset + std::max<size_t>(a.bytes, 1);
}

/// A barrier orders all that was recorded before it, so a pass needs one only for hazards that arose since the last.
/// The executor places one ahead of the first pass, which covers the frames before.
void findHazards(CompiledGraph& graph) {
    struct Use {
        std::optional<uint32_t> read, write; // the last pass that did
    };
    std::vector<Use> uses(graph.resources.size());
    uint32_t lastBarrier = 0; // stands before this pass
    for (uint32_t index = 0; index < graph.passes.size(); ++index) {
        Pass& pass = graph.passes[index];
        const auto wait = [&](HazardKind kind, uint32_t resource, uint32_t behind, std::optional<uint32_t> since) {
            if (since && *since >= lastBarrier) pass.barrierBefore.push_back({kind, resource, behind, *since});
        };
        for (const Access& access : pass.accesses) {
            const uint32_t resource = access.resource;
            const Use& use = uses[resource];
            if (access.reads) wait(HazardKind::ReadAfterWrite, resource, resource, use.write);
            if (!access.writes) continue;
            if (!access.reads) wait(HazardKind::WriteAfterWrite, resource, resource, use.write);
            wait(HazardKind::WriteAfterRead, resource, resource, use.read);
            if (graph.resources[resource].firstUse != index) continue;
            for (uint32_t old = 0; old < uses.size(); ++old) {
                if (old == resource || !shareMemory(graph.resources[old], graph.resources[resource])) continue;
                wait(HazardKind::WriteAfterRead, resource, old, uses[old].read);
                wait(HazardKind::WriteAfterWrite, resource, old, uses[old].write);
            }
        }
        for (const Access& access : pass.accesses) {
            if (access.reads) uses[access.resource].read = index;
            if (access.writes) uses[access.resource].write = index;
        }
        if (!pass.barrierBefore.empty()) lastBarrier = index;
    }
}

} // namespace

const char* pathClassName(PathClass c) {
    switch (c) {
    case PathClass::Emission:
        return "emission";
    case PathClass::Direct:
        return "direct";
    case PathClass::Caustic:
        return "caustic";
    case PathClass::Indirect:
        return "indirect";
    case PathClass::Count:
        break;
    }
    return "none";
}

const char* hazardName(HazardKind kind) {
    switch (kind) {
    case HazardKind::ReadAfterWrite:
        return "read-after-write";
    case HazardKind::WriteAfterRead:
        return "write-after-read";
    case HazardKind::WriteAfterWrite:
        return "write-after-write";
    }
    return "none";
}

const ResourceInfo* CompiledGraph::find(std::string_view name) const {
    const auto it = std::find_if(resources.begin(), resources.end(),
                                 [&](const ResourceInfo& r) { return r.used && r.name == name; });
    return it == resources.end() ? nullptr : &*it;
}

CompiledGraph compile(const CompileInput& input) {
    CompiledGraph graph{.width = input.width, .height = input.height, .passes = askNodes(input)};

    Recorder recorder(input, graph.passes);
    for (uint32_t pass = 0; pass < graph.passes.size(); ++pass)
        if (graph.passes[pass].runs()) recorder.declare(pass, *input.nodes[pass].node);
    recorder.throwErrors();
    for (const std::string& name : input.outputs) {
        if (const auto resource = recorder.find(name))
            recorder.resources()[*resource].output = true;
        else
            graph.missingOutputs.push_back(name);
    }
    graph.resources = std::move(recorder.resources());

    const std::vector<bool> live = findLive(recorder, graph.resources);
    for (uint32_t pass = 0; pass < graph.passes.size(); ++pass) {
        if (live[pass]) {
            for (const VersionedAccess& a : recorder.declarations()[pass].accesses)
                graph.passes[pass].accesses.push_back({.resource = a.resource, .reads = a.reads, .writes = a.writes});
        } else if (graph.passes[pass].runs()) {
            graph.passes[pass].reason = whyUnused(recorder, graph.passes, graph.resources, pass);
        }
    }
    for (uint32_t pass = 0; pass < graph.passes.size(); ++pass)
        if (graph.passes[pass].runs() && !live[pass]) graph.passes[pass].state = PassState::Unused;

    graph.unneeded = ownedByUnneeded(input, graph.passes);
    assignOwners(graph, recorder.declarations(), input.overlapping);
    findLifetimes(graph);
    placeResources(graph);
    findHazards(graph);
    return graph;
}

} // namespace trilume::graph
