"""Readers of meshes and implicit shapes. `read` gives arrays in the stage's units, checked on the C++ side."""

import math

import numpy as np
from pxr import UsdGeom

_UV_NAMES = ("st", "st0", "UVMap", "uv", "map1")
_SHAPES = {
    "Cube": ("size",),
    "Cylinder": ("radius", "height", "axis"),
    "Cylinder_1": ("radiusTop", "radiusBottom", "height", "axis"),
    "Cone": ("radius", "height", "axis"),
    "Capsule": ("radius", "height", "axis"),
    "Capsule_1": ("radiusTop", "radiusBottom", "height", "axis"),
    "Plane": ("width", "length", "axis"),
}


class MeshReader:
    kind = "mesh"

    def __init__(self, prim, uv_name, subsets):
        """subsets: UsdGeomSubset prims of the materialBind family."""
        self.path = str(prim.GetPath())
        self._mesh = UsdGeom.Mesh(prim)
        self._subsets = [UsdGeom.Subset(subset).GetIndicesAttr() for subset in subsets]
        self._normals = self._find_normals(prim)
        self._uvs = find_uvs(prim, uv_name)
        points = self._mesh.GetPointsAttr()
        normals = self._normals[0] if self._normals else None
        self._deforming = any(a and a.ValueMightBeTimeVarying() for a in (points, normals))
        topology = [self._mesh.GetFaceVertexCountsAttr(), self._mesh.GetFaceVertexIndicesAttr(),
                    self._mesh.GetHoleIndicesAttr(), self._uvs, *self._subsets]
        self._remodelled = any(a and a.ValueMightBeTimeVarying() for a in topology)
        self.varying = self._deforming or self._remodelled
        self._constant = {}

    def _find_normals(self, prim):
        """(attribute or primvar, interpolation); primvars:normals wins over normals."""
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
        if primvar and primvar.HasValue():
            return primvar, primvar.GetInterpolation()
        attribute = self._mesh.GetNormalsAttr()
        return (attribute, self._mesh.GetNormalsInterpolation()) if attribute.HasValue() else None

    def read(self, moment):
        time = moment.time
        mesh = self._mesh
        record = {
            "points": self._array(mesh.GetPointsAttr(), time, np.float32, 3),
            "counts": self._array(mesh.GetFaceVertexCountsAttr(), time, np.int32),
            "indices": self._array(mesh.GetFaceVertexIndicesAttr(), time, np.int32),
            "holes": self._array(mesh.GetHoleIndicesAttr(), time, np.int32),
            "subsets": [self._array(indices, time, np.int32) for indices in self._subsets],
            "leftHanded": mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded,
            "smooth": mesh.GetSubdivisionSchemeAttr().Get() in (UsdGeom.Tokens.catmullClark, UsdGeom.Tokens.loop),
            "deforming": self._deforming,
            "sameTopology": not self._remodelled,
            "normals": None,
            "uvs": None,
        }
        if self._normals:
            record["normals"] = self._primvar(*self._normals, time, 3)
        if self._uvs:
            record["uvs"] = self._primvar(self._uvs, self._uvs.GetInterpolation(), time, 2)
        return record

    def _primvar(self, source, interpolation, time, columns):
        values = self._array(source, time, np.float32, columns)
        indices = np.zeros(0, np.int32)
        if isinstance(source, UsdGeom.Primvar) and source.IsIndexed():
            indices = self._array(source.GetIndicesAttr(), time, np.int32)
        return (values, str(interpolation), indices) if len(values) else None

    def _array(self, source, time, dtype, columns=None):
        """A view of USD's own memory where the type allows it. What cannot vary is fetched once."""
        key = source.GetName()
        attribute = source.GetAttr() if isinstance(source, UsdGeom.Primvar) else source
        key = attribute.GetPath() if attribute else key
        if key in self._constant:
            return self._constant[key]
        value = as_array(attribute.Get(time) if attribute else None, dtype, columns)
        if self.varying and not (attribute and attribute.ValueMightBeTimeVarying()):
            self._constant[key] = value
        return value


class ShapeReader:
    """Cube, cylinder, cone, capsule, plane: dimensions by the schema's names."""

    kind = "shape"

    def __init__(self, prim, warn):
        self.path = str(prim.GetPath())
        self.warn = warn
        self._shape = prim.GetTypeName().replace("_1", "")
        self._attributes = [prim.GetAttribute(name) for name in _SHAPES[prim.GetTypeName()]]
        self.varying = any(a.ValueMightBeTimeVarying() for a in self._attributes)

    @staticmethod
    def reads(type_name):
        return type_name in _SHAPES

    def read(self, moment):
        """None at times when it has no extent."""
        record = {a.GetName(): moment.value(a) for a in self._attributes}
        axis = str(record.pop("axis", ""))
        sizes = {name: float(value) for name, value in record.items()}
        may_be_zero = {"height"} if self._shape == "Capsule" else set()
        if sizes.get("radiusTop") or sizes.get("radiusBottom"):
            may_be_zero |= {"radiusTop", "radiusBottom"}
        if not has_extent(self, sizes, may_be_zero):
            return None
        if "radius" in sizes:
            top = 0.0 if self._shape == "Cone" else sizes["radius"]
            sizes.update(radiusBottom=sizes.pop("radius"), radiusTop=top)
        return {"shape": self._shape, "deforming": self.varying, "axis": axis, **sizes}


class SphereReader:
    kind = "sphere"

    def __init__(self, prim, warn):
        self.path = str(prim.GetPath())
        self.warn = warn
        self._radius = UsdGeom.Sphere(prim).GetRadiusAttr()
        self.varying = self._radius.ValueMightBeTimeVarying()

    def read(self, moment):
        """None at times when it has no extent."""
        sizes = {"radius": float(moment.value(self._radius))}
        return sizes if has_extent(self, sizes) else None


def has_extent(reader, sizes, may_be_zero=()):
    """Whether the sizes, by name, are positive numbers. A size that is 0 for a while is a way to hide."""
    for name, size in sizes.items():
        if not (0 < size < math.inf or (size == 0 and name in may_be_zero)):
            if size != 0 or not reader.varying:
                reader.warn(reader.path, f"its {name} is not a positive number: left out")
            return False
    return True


def find_uvs(prim, name):
    """The primvar of that name, else of a usual one; None when there is none."""
    primvars = UsdGeom.PrimvarsAPI(prim)
    for candidate in (name, *_UV_NAMES):
        primvar = primvars.FindPrimvarWithInheritance(candidate)
        if primvar and primvar.HasValue():
            return primvar
    return None


def as_array(value, dtype, columns=None):
    """(n,) or (n, columns), contiguous; without a copy when `value` is such an array already. Empty when unusable."""
    empty = np.zeros((0,) if columns is None else (0, columns), dtype)
    if value is None:
        return empty
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        return empty
    if array.dtype.kind not in "fiu":
        return empty
    if columns is not None:
        if array.ndim == 1 and len(array) == columns:
            array = array[None]
        if array.ndim != 2 or array.shape[1] < columns:
            return empty
        array = array[:, :columns]
    elif array.ndim != 1:
        return empty
    return np.ascontiguousarray(array, dtype)


def surface_area(reader, moment, matrix):
    """Of a mesh's faces under a transform, in the stage's units: half the sum of the faces' vector areas' lengths."""
    record = reader.read(moment)
    points = record["points"].astype(np.float64) @ matrix[:3, :3]
    counts, indices = record["counts"], record["indices"]
    if not len(counts) or counts.min() < 3 or counts.sum() != len(indices) or indices.min() < 0 \
            or indices.max() >= len(points):
        return 0.0
    starts = np.cumsum(counts) - counts
    corners = points[indices] - np.repeat(points[indices[starts]], counts, axis=0)
    following = np.roll(corners, -1, axis=0)
    following[starts + counts - 1] = corners[starts]
    vectors = np.add.reduceat(np.cross(corners, following), starts)
    return 0.5 * float(np.linalg.norm(vectors, axis=1).sum())
