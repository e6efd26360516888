#include "bench_command.h"
#include "cook_command.h"
#include "core/error.h"
#include "core/text.h"
#include "core/version.h"
#include "info_command.h"
#include "render_command.h"

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <new>

namespace trilume::cli {
namespace {

/// CLI11's complaint in the shape of all errors, with the nearest word for one that is unknown.
Error asError(const CLI::ParseError& error, const CLI::App& app) {
    const auto chosen = app.get_subcommands();
    const CLI::App& command = chosen.empty() ? app : *chosen.front();
    const std::string name = chosen.empty() ? "trilume" : "trilume " + command.get_name();
    const std::string help = fmt::format("`{} --help` lists what there is", name);
    const std::vector<std::string> unknown = command.remaining();
    if (unknown.empty()) return inputError("bad command line", name, std::string(error.what()) + "; " + help);

    // An unknown option's value stands among the rest, so the option comes first.
    const auto option =
        std::find_if(unknown.begin(), unknown.end(), [](const auto& word) { return word.starts_with('-'); });
    const std::string& word = option == unknown.end() ? unknown.front() : *option;
    std::vector<std::string> known;
    for (const CLI::Option* o : command.get_options()) known.push_back(o->get_name());
    for (const CLI::App* c : command.get_subcommands({})) known.push_back(c->get_name());
    const std::string nearest = nearestWord(word, known);
    return inputError("unknown argument", word, nearest.empty() ? help : "did you mean " + nearest + "?");
}

int run(int argc, char** argv) {
    CLI::App app("Real-time global illumination of OpenUSD stages", "trilume");
    app.set_version_flag("--version", TRILUME_VERSION);
    app.require_subcommand(1);
    RenderArguments renderArguments;
    InfoArguments infoArguments;
    BenchArguments benchArguments;
    CookArguments cookArguments;
    CLI::App* render = addRenderCommand(app, renderArguments);
    CLI::App* bench = addBenchCommand(app, benchArguments);
    CLI::App* cook = addCookCommand(app, cookArguments);
    addInfoCommand(app, infoArguments);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& help) {
        return app.exit(help);
    } catch (const CLI::ParseError& error) {
        throw asError(error, app);
    }
    if (render->parsed())
        runRender(renderArguments);
    else if (bench->parsed())
        runBench(benchArguments);
    else if (cook->parsed())
        runCook(cookArguments);
    else
        runInfo(infoArguments);
    return 0;
}

int fail(const Error& error) {
    fmt::print(stderr, "trilume: error: {}\n", error.what());
    return static_cast<int>(error.fault());
}

} // namespace
} // namespace trilume::cli

int main(int argc, char** argv) {
    using namespace trilume;
    try {
        return cli::run(argc, argv);
    } catch (const Error& error) {
        return cli::fail(error);
    } catch (const std::bad_alloc&) {
        return cli::fail(runError("out of memory", "host", "render fewer pixels or close other programs"));
    } catch (const std::exception& error) {
        return cli::fail(runError("unexpected failure", error.what(), "please report this"));
    }
}
