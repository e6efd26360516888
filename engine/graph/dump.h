#pragma once

#include "graph/compile.h"

namespace trilume::graph {

/// Graphviz: running nodes as boxes with the path classes that they own, culled ones dashed with the reason, an edge
/// for each resource from its writer to its next user; a barrier shows as a bar on the node that waits.
std::string toDot(const CompiledGraph& graph);

/// {width, height, arenaBytes, historyBytes, passes[{name, state, reason, reads, writes, barrier[...]}],
/// resources[{name, kind, history, bytes, firstUse, lastUse, offset, output}], owners{class: node}, unowned[]}
std::string toJson(const CompiledGraph& graph);

} // namespace trilume::graph
