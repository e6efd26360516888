#include "bench_command.h"

#include "core/error.h"
#include "core/file.h"

#include <CLI/CLI.hpp>
#include <fmt/ranges.h>

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace trilume::cli {
namespace {

namespace fs = std::filesystem;

/// The first of: TRILUME_PYTHON, .venv of the checkout that the build tree stands in, and where that was at
/// configuration.
std::string interpreter() {
    if (const char* given = std::getenv("TRILUME_PYTHON"); given && *given) return given;
    for (const fs::path& path : {homeDirectory() / TRILUME_BENCH_PYTHON_FROM_HOME, fs::path(TRILUME_BENCH_PYTHON)})
        if (::access(path.c_str(), X_OK) == 0) return path.lexically_normal().string();
    throw inputError("no Python for the benchmarks", TRILUME_BENCH_PYTHON,
                     "run tools/bootstrap --bench, or set TRILUME_PYTHON to a Python with requirements-bench.txt");
}

void putBefore(const char* variable, const std::string& path) {
    const char* rest = std::getenv(variable);
    ::setenv(variable, (rest && *rest ? path + ":" + rest : path).c_str(), 1);
}

} // namespace

CLI::App* addBenchCommand(CLI::App& app, BenchArguments& a) {
    CLI::App* c = app.add_subcommand("bench", "Measure time, error and stability; writes a report");
    const std::vector<std::string> suites{"paper", "pareto", "tracer", "skip", "scale", "stability", "startup"};
    c->add_option("SUITE", a.suite, fmt::format("{}", fmt::join(suites, " ")))
        ->required()
        ->check(CLI::IsMember(suites))
        ->option_text(" ");
    c->add_option(
         "-o,--output", a.output,
         "folder for report.md, results.json and pictures; what was measured there before is not measured again")
        ->required()
        ->option_text("DIR");
    c->add_flag("--quick", a.quick, "two minutes on two cores rather than thirty: smaller, fewer, less exact");
    const auto repeatable = [&](const char* name, std::vector<std::string>& values, const char* doc) {
        c->add_option(name, values, doc)->option_text("NAME")->allow_extra_args(false);
    };
    repeatable("-t,--technique", a.techniques, "only this one of the suite's techniques; repeatable");
    repeatable("--stage", a.stages, "only this one of the suite's stages; repeatable");
    c->add_option("--repeats", a.repeats, "of each measurement")->check(CLI::Range(1, 1000))->option_text("N");
    c->add_option("--seed", a.seed, "of the first repeat (0)")->option_text("N");
    c->add_option("--tracer", a.tracer, "own BVH, or the driver's ray queries")
        ->check(CLI::IsMember({"auto", "compute", "query"}))
        ->option_text("auto|compute|query");
    c->add_option("--device", a.device, "auto: discrete, integrated, virtual, CPU")->option_text("auto|INDEX|NAME");
    c->add_option("--progress", a.progress, "a bar with the time left; auto: on a terminal")
        ->check(CLI::IsMember({"auto", "on", "off"}))
        ->option_text("auto|on|off");
    return c;
}

void runBench(const BenchArguments& a) {
    const std::string python = interpreter(), home = homeDirectory().string();
    std::vector<std::string> words{python,
                                   "-m",
                                   "trilume_bench",
                                   a.suite,
                                   "--home=" + home,
                                   "--command=" + fs::read_symlink("/proc/self/exe").string(),
                                   "--output=" + a.output,
                                   "--seed=" + std::to_string(a.seed),
                                   "--repeats=" + std::to_string(a.repeats),
                                   "--device=" + a.device,
                                   "--tracer=" + a.tracer,
                                   "--progress=" + a.progress};
    if (a.quick) words.emplace_back("--quick");
    for (const std::string& name : a.techniques) words.push_back("--technique=" + name);
    for (const std::string& name : a.stages) words.push_back("--stage=" + name);
    putBefore("PYTHONPATH", home + "/lib/trilume/bench");

    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    ::execvp(python.c_str(), argv.data());
    throw inputError("Python does not start", python, std::strerror(errno));
}

} // namespace trilume::cli
