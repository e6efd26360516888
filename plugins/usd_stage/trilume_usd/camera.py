"""Cameras. The schema gives apertures and focal length in tenths of a scene unit, distances in scene units."""

import math

from pxr import Gf, Usd, UsdGeom


class CameraReader:
    kind = "camera"

    _IN_TENTHS = ("horizontalAperture", "verticalAperture", "horizontalApertureOffset", "verticalApertureOffset",
                  "focalLength")

    def __init__(self, prim, meters_per_unit, warn):
        self.path = str(prim.GetPath())
        self._meters_per_unit = meters_per_unit
        names = (*self._IN_TENTHS, "clippingRange", "fStop", "focusDistance")
        self._attributes = {name: prim.GetAttribute(name) for name in names}
        self.varying = any(a.ValueMightBeTimeVarying() for a in self._attributes.values())
        first = Usd.TimeCode.EarliestTime()
        if UsdGeom.Camera(prim).GetProjectionAttr().Get(first) == UsdGeom.Tokens.orthographic:
            warn(prim.GetPath(), "orthographic cameras are not supported: shown in perspective")
        if UsdGeom.Camera(prim).ComputeLinearExposureScale(first) != 1:
            warn(prim.GetPath(), "the camera's exposure is not supported: ignored")

    def read(self, moment):
        """Millimetres and metres. A clipping range that nobody wrote does not clip: the schema's default begins at one
        scene unit, which is a metre in many stages."""
        value = {name: moment.value(attribute) for name, attribute in self._attributes.items()}
        millimetres = 100.0 * self._meters_per_unit
        clipping = value["clippingRange"]
        clips = self._attributes["clippingRange"].HasAuthoredValue() and 0 <= clipping[0] < clipping[1]
        focus = value["focusDistance"] * self._meters_per_unit
        record = {name: value[name] * millimetres for name in self._IN_TENTHS}
        record["nearClip"] = clipping[0] * self._meters_per_unit if clips else 0.0
        record["farClip"] = clipping[1] * self._meters_per_unit if clips else math.inf
        record["focusDistance"] = focus
        record["fStop"] = value["fStop"] if focus > 0 else 0.0
        defaults = Gf.Camera()
        for name, default in (("horizontalAperture", defaults.horizontalAperture),
                              ("verticalAperture", defaults.verticalAperture), ("focalLength", defaults.focalLength)):
            if not (math.isfinite(record[name]) and record[name] > 0):
                record[name] = default * millimetres
        return record
