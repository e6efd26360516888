#pragma once

#include "mesh_builder.h"
#include "python.h"
#include "scene/components.h"

#include <functional>
#include <optional>
#include <span>
#include <string>

namespace trilume::usd {

/// Finds or loads the texture of a `network.Texture` record; None when it can't be read.
/// Without a wrap, what the file says.
using FindTexture =
    std::function<TextureId(const std::string& file, ColorSpace, std::optional<Wrap> s, std::optional<Wrap> t)>;

/// Views of a mesh record's arrays. Keeps the arrays alive; the lock must be held when it dies.
struct MeshRecord {
    explicit MeshRecord(const py::dict& record);
    PolygonMesh polygons;
    bool sameTopology = false; ///< counts, indices and texture coordinates are the same at all times

private:
    py::dict owner_;
};

// Python's plain records as components; the names of their entries are those in plugins/usd_stage/trilume_usd.

Material materialFrom(const std::string& name, const py::dict& record, const FindTexture& findTexture);
Light lightFrom(const py::dict& record, const FindTexture& findTexture);
Camera cameraFrom(const py::dict& record);
/// Fills the geometry of `mesh` from an implicit shape.
void shapeFrom(const py::dict& record, Mesh& mesh);

/// The elements of a contiguous array whose elements have T's size; the array must outlive the view.
template<class T>
std::span<const T> viewOf(const py::object& array) {
    const py::buffer_info info = py::reinterpret_borrow<py::buffer>(array).request();
    const size_t bytes = static_cast<size_t>(info.size) * static_cast<size_t>(info.itemsize);
    return {static_cast<const T*>(info.ptr), bytes / sizeof(T)};
}

} // namespace trilume::usd
