"""Opens a stage, walks it once, and reads it at any time."""

import functools
from typing import NamedTuple

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade

from .camera import CameraReader
from .diagnostics import StageError, Warnings, reason, usd_messages_to
from .files import Files
from .frames import Frame, InstanceFrame, Moment, Placement, PointInstanceFrame, PointInstances
from .geometry import MeshReader, ShapeReader, SphereReader, surface_area
from .lights import Emission, LightReader
from .materials import ColorReader, GlowReader, MaterialReader

_SHOWN_PURPOSES = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
_MOST_COPIES = 1 << 24  # what Vulkan promises to place in a scene
# Prototypes of point instancers may be classes or overs, which a traversal leaves out by default.
_INSIDE_PROTOTYPE = Usd.PrimIsActive & Usd.PrimIsLoaded & Usd.PrimHasDefiningSpecifier


def quietly(method):
    """What USD prints meanwhile becomes warnings."""

    @functools.wraps(method)
    def wrapped(self, *arguments):
        with usd_messages_to(self.warn):
            return method(self, *arguments)

    return wrapped


class Inherited(NamedTuple):
    """What a prim takes from its ancestors within a frame."""

    moving: bool = False
    switches: tuple = ()   # visibility attributes that may vary
    hidden: bool = False   # at all times
    purpose: str = str(UsdGeom.Tokens.default_)

    def of(self, prim, time):
        if not prim.IsA(UsdGeom.Imageable):
            return self
        imageable = UsdGeom.Imageable(prim)
        moving, switches, hidden = self.moving, self.switches, self.hidden
        visibility = imageable.GetVisibilityAttr()
        if visibility.ValueMightBeTimeVarying():
            switches = (*switches, visibility)
        elif visibility.Get(time) == UsdGeom.Tokens.invisible:
            hidden = True
        if prim.IsA(UsdGeom.Xformable):
            xformable = UsdGeom.Xformable(prim)
            own = xformable.TransformMightBeTimeVarying()
            moving = own or (moving and not xformable.GetResetXformStack())
        authored = imageable.GetPurposeAttr()
        purpose = str(authored.Get()) if authored.HasAuthoredValue() else self.purpose
        return Inherited(moving, switches, hidden, purpose)

    @property
    def drawn(self):
        return not self.hidden and self.purpose in _SHOWN_PURPOSES


class Stage:
    """See the package's description. `start` is the time that the lists were made for."""

    def __init__(self, path):
        self.warn = Warnings()
        self.materials, self.assets, self.placements = [], [], []
        self._files = Files()
        self._numbers = {}  # of assets and materials, by what makes them the same
        self._open(path)

    @quietly
    def _open(self, path):
        try:
            self._stage = Usd.Stage.Open(path)
            self._stage.Reload()  # layers that another open stage holds may have changed on disk
        except Exception as error:
            raise StageError(f"not a readable USD stage ({reason(error)})", "check the file") from None
        for error in self._stage.GetCompositionErrors():
            self.warn(error.rootSite.path if str(error.rootSite.path) != "/" else "", error)
        self.meters_per_unit = UsdGeom.GetStageMetersPerUnit(self._stage)
        if not 0 < self.meters_per_unit < float("inf"):
            self.warn("", f"metersPerUnit {self.meters_per_unit:g} is not a positive number: 0.01 is used")
            self.meters_per_unit = 0.01
        self.z_up = UsdGeom.GetStageUpAxis(self._stage) == UsdGeom.Tokens.z
        self.time_codes_per_second = self._stage.GetTimeCodesPerSecond()
        self.start = self._stage.GetStartTimeCode() if self._stage.HasAuthoredTimeCodeRange() else None
        self.end = self._stage.GetEndTimeCode() if self._stage.HasAuthoredTimeCodeRange() else None
        # Without a range the first samples are shown: at the default time an animated attribute may have no value.
        self.moment = Moment(Usd.TimeCode.EarliestTime() if self.start is None else Usd.TimeCode(self.start))
        self._walk(Frame(), self._stage.GetPseudoRoot(), Inherited(), Usd.PrimDefaultPredicate, ())
        self._varying_materials = self._varying(self.materials)
        self._varying_assets = self._varying(self.assets)
        self._varying_placements = self._varying(self.placements)
        self._check_copies(self.placements)

    def _check_copies(self, placements):
        counts = [placement.copies(self.moment) for placement in placements]
        if sum(counts) > _MOST_COPIES:
            most = placements[int(np.argmax(counts))]
            raise StageError(f"{sum(counts)} copies of prims, most of them of {most.path}, are more than {_MOST_COPIES}",
                             "use fewer instances in its point instancers")

    @staticmethod
    def _varying(items):
        return [number for number, item in enumerate(items) if item.varying]

    @property
    def varying(self):
        return bool(self._varying_materials or self._varying_assets or self._varying_placements)

    def render_settings(self):
        """Camera path (or "") and resolution (or 0, 0)."""
        settings = UsdRender.Settings.GetStageRenderSettings(self._stage)
        if not settings:
            folder = self._stage.GetPrimAtPath("/Render")
            found = [p for p in Usd.PrimRange(folder) if p.IsA(UsdRender.Settings)] if folder else []
            settings = UsdRender.Settings(found[0]) if found else None
        if not settings:
            return "", 0, 0
        cameras = settings.GetCameraRel().GetForwardedTargets()
        resolution = settings.GetResolutionAttr()
        width, height = resolution.Get() if resolution.HasAuthoredValue() else (0, 0)
        return str(cameras[0]) if cameras else "", max(0, width), max(0, height)

    @quietly
    def read(self, item):
        """The record of one of `materials` or `assets` at the present time; None when it is not there, or, with a warning,
        when USD fails."""
        return self._read(item)

    @quietly
    def sample(self, placement):
        """See Placement.sample; None, with a warning, when USD fails."""
        return self._sample(placement)

    def names(self, placement):
        return placement.names(self.moment)

    @quietly
    def update(self, time):
        """Moves to `time`: numbers and new values of the materials, assets and placements that may vary."""
        self.moment = Moment(Usd.TimeCode(time))
        self._check_copies([self.placements[n] for n in self._varying_placements])
        return ([(n, self._read(self.materials[n])) for n in self._varying_materials],
                [(n, self._read(self.assets[n])) for n in self._varying_assets],
                [(n, self._sample(self.placements[n])) for n in self._varying_placements])

    @quietly
    def sample_times(self):
        """Of all attributes that may vary, in order."""
        times = set()
        for root in (self._stage.GetPseudoRoot(), *self._stage.GetPrototypes()):
            for prim in Usd.PrimRange(root, Usd.PrimAllPrimsPredicate):
                for attribute in prim.GetAuthoredAttributes():
                    if attribute.ValueMightBeTimeVarying():
                        times.update(attribute.GetTimeSamples())
        return sorted(times)

    def _read(self, item):
        try:
            return item.read(self.moment)
        except Exception as error:
            self.warn(item.path, f"not readable ({reason(error)}): left out")
            return None

    def _sample(self, placement):
        try:
            return placement.sample(self.moment)
        except Exception as error:
            self.warn(placement.path, f"its transform is not readable ({reason(error)}): left out")
            return None

    # ---- the walk ----------------------------------------------------------------------------------

    def _walk(self, frame, root, inherited, predicate, above):
        """Depth first, in the order of the file. inherited: with the root's own. above: point instancers that this is inside of."""
        predicate = Usd.TraverseInstanceProxies(predicate)
        groups = {}
        pending = [(root, inherited)]
        while pending:
            prim, inherited = pending.pop()
            try:
                if prim != root:
                    inherited = inherited.of(prim, self.moment.time)
                if prim.IsA(UsdGeom.PointInstancer):
                    self._walk_point_instancer(prim, frame, inherited, above)
                elif prim.IsInstance() and prim != root and not prim.IsA(UsdGeom.Gprim):
                    if not inherited.hidden:
                        groups.setdefault(self._likeness(prim, inherited), []).append(
                            (prim, inherited.moving, inherited.switches))
                else:
                    pending += [(child, inherited) for child in reversed(prim.GetFilteredChildren(predicate))]
                    self._visit(prim, frame, inherited)
            except Exception as error:
                self.warn(prim.GetPath(), f"not readable ({reason(error)}): left out")
        for key, members in groups.items():
            inner = InstanceFrame(frame, members)
            self._walk(inner, inner.root, Inherited(purpose=key[1]), predicate, above)

    def _likeness(self, prim, inherited):
        """Instances for which this is equal show the same."""
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)[0]
        primvars = UsdGeom.PrimvarsAPI(prim).FindInheritablePrimvars()
        return (prim.GetPrototype().GetPath(), inherited.purpose, str(material.GetPath()) if material else "",
                tuple(sorted((str(p.GetName()), str(p.ComputeFlattened(self.moment.time))) for p in primvars)))

    def _walk_point_instancer(self, prim, frame, inherited, above):
        if not inherited.drawn:
            return
        if prim.GetPath() in above:
            self.warn(prim.GetPath(), "a point instancer that contains itself is left out")
            return
        instances = PointInstances(prim, frame, inherited.moving, inherited.switches, self.warn)
        instances.sample(self.moment)  # names what is wrong with it, also when nothing is left to place
        for number, root in enumerate(instances.prototypes):
            if root:
                self._walk(PointInstanceFrame(instances, number), root,
                           Inherited().of(root, self.moment.time)._replace(moving=False),
                           _INSIDE_PROTOTYPE, (*above, prim.GetPath()))

    def _visit(self, prim, frame, inherited):
        name = prim.GetTypeName()
        if name == "Camera":
            self._place(CameraReader(prim, self.meters_per_unit, self.warn), prim, frame, inherited)
        elif not inherited.drawn:
            return
        elif name == "Mesh":
            self._place_mesh(prim, frame, inherited)
        elif name == "Sphere":
            self._place(self._asset(prim, lambda p: SphereReader(p, self.warn)), prim, frame, inherited, self._material_numbers(prim))
        elif ShapeReader.reads(name):
            self._place(self._asset(prim, lambda p: ShapeReader(p, self.warn)), prim, frame, inherited, self._material_numbers(prim))
        elif LightReader.reads(name):
            light = LightReader(prim, self.meters_per_unit, self._files, self.warn)
            self._place(light, prim, frame, inherited, local=light.pole(self._stage))
        elif name == "SkelRoot":
            self.warn(prim.GetPath(), "skeletons are not supported: meshes are shown in their rest pose")
        elif name != "Skeleton" and (prim.IsA(UsdGeom.Boundable) or prim.HasAPI(UsdLux.LightAPI)):
            self.warn(prim.GetPath(), f"prims of type {name or 'LightAPI'} are not supported: left out")

    def _place(self, asset, prim, frame, inherited, materials=(), local=None):
        number = asset if isinstance(asset, int) else self._append(self.assets, asset)
        self.placements.append(Placement(number, prim, frame, inherited.moving, inherited.switches, materials, local))

    def _asset(self, prim, make, *key):
        """The number of the asset that `make(prim)` gives, shared by the prim's copies."""
        return self._shared(self.assets, (geometry_path(prim), *key), lambda: make(prim))

    def _shared(self, items, key, make):
        if key not in self._numbers:
            self._numbers[key] = self._append(items, make())
        return self._numbers[key]

    @staticmethod
    def _append(items, item):
        items.append(item)
        return len(items) - 1

    def _place_mesh(self, prim, frame, inherited):
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
        numbers = [self._material_number(prim, self._bound(p), prim) for p in [prim, *(s.GetPrim() for s in subsets)]]
        uv_names = {getattr(self.materials[n], "uv_name", "st") for n in numbers} - {"st"}
        if len(uv_names) > 1:
            self.warn(prim.GetPath(), "its materials use several sets of texture coordinates: one of them is used")
        uv_name = min(uv_names, default="st")
        mesh = self._asset(prim, lambda _: MeshReader(prim, uv_name, [s.GetPrim() for s in subsets]), uv_name)
        if prim.HasAPI(UsdLux.MeshLightAPI):
            numbers = [self._glowing(prim, frame, self.assets[mesh], self.materials[n]) for n in numbers]
        self._place(mesh, prim, frame, inherited, numbers)

    def _glowing(self, prim, frame, mesh, base):
        """The material of a mesh light. A copy's area is that of the first: emission is a matter of the material."""
        place = Placement(0, prim, frame, True, ())

        def area(moment):
            matrices = place.sample(moment)[0]
            return surface_area(mesh, moment, matrices[0]) if len(matrices) else 0.0

        mode = prim.GetAttribute("light:materialSyncMode").Get()
        return self._append(self.materials,
                            GlowReader(str(prim.GetPath()), base, Emission(prim, self.warn), str(mode), area))

    # ---- materials ---------------------------------------------------------------------------------

    @staticmethod
    def _bound(prim):
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)[0]
        return material.GetPrim() if material else None

    def _material_numbers(self, prim):
        return [self._material_number(prim, self._bound(prim), prim)]

    def _material_number(self, prim, material, mesh):
        if material is None:
            color = self._display_color(mesh) or (0.18, 0.18, 0.18)
            return self._shared(self.materials, ("color", color), lambda: ColorReader(str(prim.GetPath()), color))
        path = geometry_path(material)
        number = self._shared(self.materials, ("material", path), lambda: self._material_reader(material))
        names = self.materials[number].primvar_names
        if not names:
            return number
        values = {name: self._constant_primvar(mesh, name) for name in sorted(names)}
        values = {name: value for name, value in values.items() if value is not None}
        return self._shared(self.materials, ("material", path, str(values)),
                            lambda: self._material_reader(material, values))

    def _material_reader(self, material, primvars=None):
        return MaterialReader(material, self._files, self.warn, self.moment, primvars)

    def _display_color(self, prim):
        value = self._constant_primvar(prim, "displayColor")
        if value is None or len(value) != 3 or not np.isfinite(value).all():
            return None
        return tuple(float(c) for c in value)

    def _constant_primvar(self, prim, name):
        """One value for the whole mesh: the mean, with a warning, of what varies over it."""
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        value = primvar.ComputeFlattened(self.moment.time) if primvar and primvar.HasValue() else None
        if value is None or not hasattr(value, "__len__") or isinstance(value, (str, Gf.Vec3f)):
            return value
        array = np.asarray(value)
        if not len(array) or array.dtype.kind not in "fiu":
            return None
        if len(array) > 1 and (array != array[0]).any():
            self.warn(prim.GetPath(), f"{name} varies over the surface: its mean is used")
        mean = array.mean(axis=0)
        return tuple(float(c) for c in mean) if array.ndim > 1 else float(mean)


def geometry_path(prim):
    """Where the prim is defined: in the prototype for parts of instances."""
    return str((prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath())
