#include "core/error.h"
#include "core/text.h"
#include "core/version.h"
#include "info_command.h"
#include "render_command.h"

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <new>

namespace trilume::cli {
namespace {

/// CLI11's complaint in the shape of all errors, with the nearest option for one that is unknown.
Error asError(const CLI::ParseError& error, const CLI::App& app) {
    const CLI::App* command = &app;
    if (const auto chosen = app.get_subcommands(); !chosen.empty()) command = chosen.front();
    std::string hint =
        fmt::format("`{} --help` lists the options", command == &app ? "trilume" : "trilume " + command->get_name());
    for (const std::string& word : command->remaining()) {
        std::vector<std::string> options;
        for (const CLI::Option* option : command->get_options()) options.push_back(option->get_name());
        if (const std::string nearest = nearestWord(word, options); !nearest.empty())
            hint = "did you mean " + nearest + "?";
    }
    return inputError("bad command line", error.what(), hint);
}

int run(int argc, char** argv) {
    CLI::App app("Real-time global illumination of OpenUSD stages", "trilume");
    app.set_version_flag("--version", TRILUME_VERSION);
    app.require_subcommand(1);
    RenderArguments renderArguments;
    InfoArguments infoArguments;
    CLI::App* render = addRenderCommand(app, renderArguments);
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
