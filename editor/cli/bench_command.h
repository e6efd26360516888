#pragma once

#include <CLI/App.hpp>

#include <string>
#include <vector>

namespace trilume::cli {

/// The options of `trilume bench`, as given.
struct BenchArguments {
    std::string suite, output;
    bool quick = false;
    std::string device = "auto", tracer = "auto";
    std::vector<std::string> techniques, stages; ///< empty: the suite's own
    uint64_t seed = 0;
    uint32_t repeats = 0; ///< 0: the suite's own
    std::string progress = "auto";
};

/// Adds `bench` to the command; its options are written to `arguments`.
CLI::App* addBenchCommand(CLI::App& app, BenchArguments& arguments);

/// Replaces this process by Python, which runs the suite (editor/bench). Returns only by throwing Error.
[[noreturn]] void runBench(const BenchArguments& arguments);

} // namespace trilume::cli
