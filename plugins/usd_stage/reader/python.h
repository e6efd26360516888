#pragma once

#include <pybind11/pybind11.h>

namespace trilume::usd {

namespace py = pybind11;

/// Starts an interpreter when the process has none: isolated from the environment, without signal handlers, and never
/// shut down, since the packages that it loads do not survive that. Returns without the global lock: take it by
/// py::gil_scoped_acquire.
void ensurePython();

/// The package `trilume_usd`, which imports pxr. Needs the global lock.
/// Throws runError when the package or usd-core is not found.
py::module_ importReader();

} // namespace trilume::usd
