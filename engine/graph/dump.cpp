#include "graph/dump.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace trilume::graph {

namespace {

/// A quoted DOT string.
std::string dotString(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + '"';
}

const char* stateName(PassState state) {
    switch (state) {
    case PassState::Run:
        return "run";
    case PassState::NotNeeded:
        return "not needed";
    case PassState::Disabled:
        return "disabled";
    case PassState::Unused:
        return "unused";
    }
    return "none";
}

const char* roleName(HistoryRole role) {
    switch (role) {
    case HistoryRole::None:
        return "none";
    case HistoryRole::Current:
        return "current";
    case HistoryRole::Persistent:
        return "persistent";
    case HistoryRole::Previous:
        return "previous";
    }
    return "none";
}

} // namespace

std::string toDot(const CompiledGraph& graph) {
    std::string dot = "digraph frame {\n  rankdir=TB;\n  node [shape=box, fontname=\"sans-serif\"];\n"
                      "  edge [fontname=\"sans-serif\", fontsize=10];\n";
    for (uint32_t i = 0; i < graph.passes.size(); ++i) {
        const Pass& pass = graph.passes[i];
        std::string label = pass.name;
        for (size_t c = 0; c < graph.owners.size(); ++c)
            if (graph.owners[c] == i) label += fmt::format(" | {}", pathClassName(static_cast<PathClass>(c)));
        if (!pass.runs()) label += fmt::format(" ({})", pass.reason);
        dot += fmt::format("  n{} [label={}{}{}];\n", i, dotString(label), pass.runs() ? "" : ", style=dashed",
                           pass.barrierBefore.empty() ? "" : ", penwidth=2");
    }
    std::vector<std::optional<uint32_t>> writer(graph.resources.size());
    for (uint32_t i = 0; i < graph.passes.size(); ++i)
        for (const Access& access : graph.passes[i].accesses) {
            const ResourceInfo& resource = graph.resources[access.resource];
            if (writer[access.resource])
                dot += fmt::format("  n{} -> n{} [label={}];\n", *writer[access.resource], i, dotString(resource.name));
            if (access.writes) writer[access.resource] = i;
        }
    // Last frame's halves come from the pass that writes the pair to the end.
    for (uint32_t i = 0; i < graph.passes.size(); ++i)
        for (const Access& access : graph.passes[i].accesses)
            if (graph.resources[access.resource].role == HistoryRole::Previous)
                dot += fmt::format("  n{} -> n{} [label={}, style=dotted, constraint=false];\n",
                                   *writer[access.resource - 1], i, dotString(graph.resources[access.resource].name));
    return dot + "}\n";
}

std::string toJson(const CompiledGraph& graph) {
    using nlohmann::json;
    json passes = json::array(), resources = json::array();
    for (const Pass& pass : graph.passes) {
        json reads = json::array(), writes = json::array(), barrier = json::array();
        for (const Access& access : pass.accesses) {
            if (access.reads) reads.push_back(graph.resources[access.resource].name);
            if (access.writes) writes.push_back(graph.resources[access.resource].name);
        }
        for (const Hazard& hazard : pass.barrierBefore)
            barrier.push_back({{"kind", hazardName(hazard.kind)},
                               {"resource", graph.resources[hazard.resource].name},
                               {"behind", graph.resources[hazard.behind].name},
                               {"pass", graph.passes[hazard.pass].name}});
        passes.push_back({{"name", pass.name},
                          {"state", stateName(pass.state)},
                          {"reason", pass.reason},
                          {"reads", reads},
                          {"writes", writes},
                          {"barrier", barrier}});
    }
    for (const ResourceInfo& resource : graph.resources) {
        if (!resource.used) continue;
        json entry{{"name", resource.name},
                   {"kind", resource.kind == ResourceKind::Plane ? "plane" : "buffer"},
                   {"history", roleName(resource.role)},
                   {"bytes", resource.bytes},
                   {"firstUse", resource.firstUse},
                   {"lastUse", resource.lastUse},
                   {"output", resource.output}};
        if (resource.role == HistoryRole::None) entry["offset"] = resource.offset;
        resources.push_back(std::move(entry));
    }
    json owners = json::object(), unowned = json::array();
    for (size_t c = 0; c < graph.owners.size(); ++c)
        if (graph.owners[c]) owners[pathClassName(static_cast<PathClass>(c))] = graph.passes[*graph.owners[c]].name;
    for (const PathClass c : graph.unowned) unowned.push_back(pathClassName(c));
    return json{{"width", graph.width},
                {"height", graph.height},
                {"arenaBytes", graph.arenaBytes},
                {"historyBytes", graph.historyBytes},
                {"passes", passes},
                {"resources", resources},
                {"owners", owners},
                {"unowned", unowned}}
        .dump(2);
}

} // namespace trilume::graph
