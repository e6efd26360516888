#pragma once

#include <CLI/App.hpp>

#include <string>

namespace trilume::cli {

/// The options of `trilume cook`, as given.
struct CookArguments {
    std::string stage, output;
    std::string frames; ///< empty: all that the stage samples
};

/// Adds `cook` to the command; its options are written to `arguments`.
CLI::App* addCookCommand(CLI::App& app, CookArguments& arguments);

/// Reads the stage and writes it as a .tlscene. Needs no device.
void runCook(const CookArguments& arguments);

} // namespace trilume::cli
