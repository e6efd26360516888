#include "python.h"

#include "core/error.h"
#include "core/file.h"

#include <dlfcn.h>
#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

namespace trilume::usd {
namespace {

namespace fs = std::filesystem;

void startInterpreter() {
    // Extension modules take Python's symbols from the global scope, but plugins are loaded into a local one.
    if (Dl_info python{}; dladdr(reinterpret_cast<const void*>(&Py_IsInitialized), &python))
        dlopen(python.dli_fname, RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD);
    PyPreConfig preConfig;
    PyPreConfig_InitIsolatedConfig(&preConfig);
#ifdef __SANITIZE_ADDRESS__
    // The leak check does not look into Python's own arenas and would take what they hold for lost.
    preConfig.allocator = PYMEM_ALLOCATOR_MALLOC;
#endif
    PyStatus status = Py_PreInitialize(&preConfig);
    PyConfig config;
    PyConfig_InitIsolatedConfig(&config);
    config.install_signal_handlers = 0;
    config.site_import = 0;
    // Without a home Python would look for itself along PATH and could find another version.
    if (!PyStatus_Exception(status)) status = PyConfig_SetBytesString(&config, &config.home, TRILUME_PYTHON_HOME);
    if (!PyStatus_Exception(status)) status = Py_InitializeFromConfig(&config);
    PyConfig_Clear(&config);
    if (PyStatus_Exception(status))
        throw runError(fmt::format("Python does not start ({})", status.err_msg ? status.err_msg : "no reason given"),
                       TRILUME_PYTHON_HOME, "run tools/bootstrap, which installs it");
    PyEval_SaveThread();
}

/// `trilume_usd` stands beside the plugin's library; programs that link the reader find the home's.
fs::path packageDirectory() {
    std::error_code ignored;
    if (Dl_info self{}; dladdr(reinterpret_cast<const void*>(&ensurePython), &self))
        if (fs::path here = fs::absolute(self.dli_fname).parent_path(); fs::exists(here / "trilume_usd", ignored))
            return here;
    return homeDirectory() / "lib/trilume/plugins/usd_stage";
}

/// The first folder with usd-core of: TRILUME_PYTHON_PATH, the checkout that the build tree stands in, and where it was
/// at configuration. Empty: the interpreter's own search path has to do.
fs::path sitePackages() {
    std::vector<fs::path> candidates;
    if (const char* path = std::getenv("TRILUME_PYTHON_PATH")) candidates.emplace_back(path);
    candidates.push_back(homeDirectory() / TRILUME_PYTHON_SITE_PACKAGES_FROM_HOME);
    candidates.emplace_back(TRILUME_PYTHON_SITE_PACKAGES);
    for (const fs::path& candidate : candidates) {
        std::error_code ignored;
        if (fs::is_directory(candidate / "pxr", ignored)) return fs::weakly_canonical(candidate);
    }
    return {};
}

bool canImport(const char* name) { return !py::module_::import("importlib.util").attr("find_spec")(name).is_none(); }

} // namespace

void ensurePython() {
    static std::once_flag once;
    std::call_once(once, [] {
        if (!Py_IsInitialized()) startInterpreter();
    });
}

py::module_ importReader() {
    auto path = py::module_::import("sys").attr("path").cast<py::list>();
    if (!canImport("trilume_usd")) path.insert(0, packageDirectory().string());
    if (!canImport("pxr"))
        if (const fs::path packages = sitePackages(); !packages.empty()) path.append(packages.string());
    try {
        return py::module_::import("trilume_usd");
    } catch (const py::error_already_set& e) {
        throw runError(fmt::format("the OpenUSD reader does not start ({})", py::str(e.value()).cast<std::string>()),
                       packageDirectory().string(),
                       "run tools/bootstrap, or set TRILUME_PYTHON_PATH to a folder with usd-core");
    }
}

} // namespace trilume::usd
