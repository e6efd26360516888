#pragma once

#include "scene/components.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trilume::usd {

enum class Interpolation { Constant, Uniform, Vertex, Varying, FaceVarying };

/// Values over a mesh as USD stores them: by element, through indices when there are any.
template<class T>
struct Primvar {
    std::span<const T> values;
    Interpolation interpolation = Interpolation::Vertex;
    std::span<const int> indices;
};

/// A polygon mesh as a stage has it, unchecked. Views must outlive the calls that they are given to.
struct PolygonMesh {
    std::span<const glm::vec3> points;
    std::span<const int> counts, indices;      ///< corners per face; points by corner
    std::span<const int> holes;                ///< faces that are not there
    std::vector<std::span<const int>> subsets; ///< faces by subset; the others make subset 0, these 1, 2, ...
    bool leftHanded = false;
    bool smooth = false;    ///< without normals: smooth over vertices, else flat
    bool deforming = false; ///< points vary with time
    std::optional<Primvar<glm::vec3>> normals;
    std::optional<Primvar<glm::vec2>> uvs;
};

/// How triangles came from polygons; deforming meshes keep it to follow their points.
struct Topology {
    std::vector<glm::uvec3> triangles; ///< points
    std::vector<glm::uvec3> corners;   ///< corners of faces, counted over the mesh
    std::vector<uint32_t> faces;
    size_t pointCount = 0;
};

/// What was left out and why.
struct Problem {
    size_t count = 0; ///< 0: all of it
    std::string_view what;
    std::string text() const;
};
using Problems = std::vector<Problem>;

/// Triangles of every usable face. Faces with holes, too few corners, bad indices or points that are not finite are
/// left out; so are triangles without area, unless the mesh deforms.
Topology buildTopology(const PolygonMesh& polygons, Problems& problems);

/// Fills `mesh` except its name and revisions; triangles are empty when nothing is usable.
void buildMesh(const PolygonMesh& polygons, const Topology& topology, Mesh& mesh, Problems& problems);

/// Moves a mesh with this topology to new points, as many as it was made for, and normals; false when they equal the
/// old ones. Points that are not finite stay where they were.
bool updatePoints(const PolygonMesh& polygons, const Topology& topology, Mesh& mesh, Problems& problems);

} // namespace trilume::usd
