"""UsdLux lights. Radiance is intensity * 2^exposure * color, times the colour of a black body when enabled."""

import math

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from .files import find_file

_SIZES = {
    "RectLight": ("width", "height"),
    "DiskLight": ("radius",),
    "SphereLight": ("radius",),
    "CylinderLight": ("radius", "length"),
    "DistantLight": ("angle",),
    "DomeLight": (),
    "DomeLight_1": (),
}
_COMMON = ("intensity", "exposure", "color", "enableColorTemperature", "colorTemperature", "normalize")
_UNSUPPORTED = {"shaping:focus": 0.0, "shaping:cone:angle": 90.0, "shaping:ies:file": None, "diffuse": 1.0,
                "specular": 1.0}
_UNSUPPORTED_PLAIN = {"treatAsPoint": False, "treatAsLine": False, "inputs:shadow:enable": True}


class Emission:
    """The inputs that all lights share, of a light or of a mesh with MeshLightAPI."""

    def __init__(self, prim, warn):
        self._prim = prim
        self._warn = warn
        self._attributes = {name: light_input(prim, name) for name in _COMMON}
        self.varying = any(a and a.ValueMightBeTimeVarying() for a in self._attributes.values())
        self._name_unsupported()

    def radiance(self, moment):
        """W/(m^2 sr), linear Rec. 709, before any division by area: three floats."""
        get = {name: a.Get(moment.time) if a else None for name, a in self._attributes.items()}
        color = get["color"] if get["color"] is not None else (1, 1, 1)
        scale = (1 if get["intensity"] is None else get["intensity"]) * 2.0 ** (get["exposure"] or 0)
        if get["enableColorTemperature"] and get["colorTemperature"]:
            tint = UsdLux.BlackbodyTemperatureAsRgb(get["colorTemperature"])
            color = [c * t for c, t in zip(color, tint)]
        radiance = [float(c) * scale for c in color]
        if not all(0 <= c < math.inf for c in radiance):
            self._warn(self._prim.GetPath(), "emission is negative or not finite: taken as 0 there")
            radiance = [c if 0 <= c < math.inf else 0.0 for c in radiance]
        return tuple(radiance)

    def normalized(self, moment):
        attribute = self._attributes["normalize"]
        return bool(attribute and attribute.Get(moment.time))

    def _name_unsupported(self):
        prim = self._prim
        attributes = [(name, light_input(prim, name), default) for name, default in _UNSUPPORTED.items()]
        attributes += [(name, prim.GetAttribute(name), default) for name, default in _UNSUPPORTED_PLAIN.items()]
        for name, attribute, default in attributes:
            if attribute and attribute.HasAuthoredValue() and constant(attribute) not in (default, Sdf.AssetPath()):
                self._warn(prim.GetPath(), f"the light's {name} is not supported: ignored")
        for name in ("light:filters", "collection:lightLink:excludes", "collection:shadowLink:excludes"):
            relationship = prim.GetRelationship(name)
            if relationship and relationship.GetTargets():
                self._warn(prim.GetPath(), f"the light's {name} is not supported: ignored")


class LightReader:
    kind = "light"

    def __init__(self, prim, meters_per_unit, files, warn):
        self.path = str(prim.GetPath())
        self._prim = prim
        self._warn = warn
        self._files = files
        self._area_of_unit = meters_per_unit ** 2
        self._type = prim.GetTypeName()
        self._emission = Emission(prim, warn)
        self._sizes = {name: light_input(prim, name) for name in _SIZES[self._type]}
        self._texture = light_input(prim, "texture:file")
        attributes = [*self._sizes.values(), self._texture]
        self.varying = self._emission.varying or any(a and a.ValueMightBeTimeVarying() for a in attributes)
        layout = light_input(prim, "texture:format")
        if layout and constant(layout) not in (UsdLux.Tokens.automatic, UsdLux.Tokens.latlong):
            warn(prim.GetPath(), f"dome texture format {constant(layout)} is not supported: read as latlong")

    @staticmethod
    def reads(type_name):
        return type_name in _SIZES

    def read(self, moment):
        """`normalize` divides by area in the stage's units, as all renderers of USD do; the engine divides by square
        metres, so the unit's area goes into radiance here."""
        radiance = self._emission.radiance(moment)
        normalize = self._emission.normalized(moment) and not self._type.startswith("Dome")
        if normalize and self._type != "DistantLight":
            radiance = tuple(c * self._area_of_unit for c in radiance)
        record = {"light": self._type.removesuffix("_1").removesuffix("Light"), "radiance": radiance,
                  "normalize": normalize, "texture": None}
        for name, attribute in self._sizes.items():
            size = float(moment.value(attribute))
            if not 0 <= size < math.inf or (size == 0 and name != "angle"):
                self._warn(self._prim.GetPath(), f"the light's {name} is not a positive number: it gives no light")
                size, record["radiance"] = 0.0, (0.0, 0.0, 0.0)  # without extent it has no surface either
            record[name] = size
        if self._texture and (asset := self._texture.Get(moment.time)):
            record["texture"] = find_file(asset, self._texture, self._files, self._warn)
        return record

    def pole(self, stage):
        """(4, 4) that turns a dome's pole, +Y, to where the light wants it; None: it stays."""
        if self._type != "DomeLight_1":
            return None
        axis = self._prim.GetAttribute("poleAxis").Get()
        if axis == UsdLux.Tokens.scene:
            axis = UsdGeom.GetStageUpAxis(stage)
        if axis != UsdGeom.Tokens.z:
            return None
        return np.array(Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), 90)))


def constant(attribute):
    """Of what is read once: with time samples, the first."""
    return attribute.Get(Usd.TimeCode.EarliestTime())


def light_input(prim, name):
    """inputs:name, or the name without prefix that stages before USD 21.05 have."""
    attribute = prim.GetAttribute("inputs:" + name)
    if not (attribute and attribute.HasAuthoredValue()):
        plain = prim.GetAttribute(name)
        if plain and plain.HasAuthoredValue():
            return plain
    return attribute
