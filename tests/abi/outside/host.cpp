// A program that hosts the engine: `host PLUGIN_FOLDER` loads the toy plugin, compiles its technique's graph, and says
// where it found the installation and its techniques.

#include "core/error.h"
#include "core/file.h"
#include "graph/compile.h"
#include "plugin/registry.h"

#include <iostream>

int main(int, char** argv) try {
    using namespace trilume;
    Registry registry;
    registry.loadPlugin(argv[1]);

    const Technique& technique = registry.technique("toy");
    std::vector<std::unique_ptr<graph::Node>> owned;
    std::vector<graph::GraphNode> nodes;
    for (const std::string& name : technique.nodes) {
        owned.push_back(registry.node(name).create());
        nodes.push_back({.name = name, .node = owned.back().get()});
    }
    ParamSet params(registry.params());
    for (const auto& [name, value] : technique.defaults) params.setDefault(name, value);
    const std::vector<std::string> outputs{"toy.color"};
    const graph::SceneFacts facts;
    const graph::CompiledGraph graph = graph::compile({nodes, facts, params, 10, 10, outputs});

    std::cout << "home " << homeDirectory().string() << "\nbytes " << graph.find("toy.color")->bytes << "\ntechniques";
    for (const Technique& t : registry.techniques()) std::cout << ' ' << t.name;
    std::cout << "\ncomposite " << (registry.node("composite").create() ? "made" : "missing") << '\n';
} catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
}
