#pragma once

#include <CLI/App.hpp>

namespace trilume::cli {

struct InfoArguments {
    bool json = false;
};

/// Adds `info` to the command; its options are written to `arguments`.
CLI::App* addInfoCommand(CLI::App& app, InfoArguments& arguments);

/// Prints what this installation has on this machine: version, devices, tracers, techniques, plugins and parameters.
void runInfo(const InfoArguments& arguments);

} // namespace trilume::cli
