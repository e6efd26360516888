#pragma once

#include "scene/components.h"

namespace trilume::usd {

enum class Axis { X, Y, Z };

// Tessellations of USD's implicit shapes, centred at the origin, in the schemas' units; curved sides have smooth
// normals. Fill positions, triangles, normals and uvs of `mesh`; the topology is the same for all dimensions.

void buildCube(double size, Mesh& mesh);
/// A rectangle that faces +axis: `width` along x (along z for Axis::X), `length` along y (along z for Axis::Y).
void buildPlane(double width, double length, Axis axis, Mesh& mesh);
/// Side and both caps, the bottom at -height / 2; a cone has radiusTop 0.
void buildCylinder(double radiusBottom, double radiusTop, double height, Axis axis, Mesh& mesh);
/// `height` is that of the side, without the half spheres at its ends.
void buildCapsule(double radiusBottom, double radiusTop, double height, Axis axis, Mesh& mesh);

} // namespace trilume::usd
