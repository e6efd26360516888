"""Reads a USD stage as plain data for Cycles, by the same converter as for Mitsuba, into parts {kind, ..., bsdf, emission} and a
camera: python -m trilume_bench.usd_to_cycles STAGE WIDTH HEIGHT SCENE.json"""

import json
import sys

import numpy as np
from pxr import Usd

from . import offline

offline.choose_variant()
from .usd_to_mitsuba import NotComparable, _Converter  # noqa: E402


class _PlainConverter(_Converter):
    def loaded(self, bsdf):
        nested = bsdf.get("nested", bsdf)
        if nested["type"] == "diffuse":
            return {"type": "diffuse", "color": nested["reflectance"]["value"]}
        if nested["type"] == "conductor":
            return {"type": "mirror"}
        return {"type": "glass", "ior": nested["int_ior"], "color": nested["specular_transmittance"]["value"]}

    def triangles(self, prim, bound, points, triangles):
        bsdf, emission = self.material(bound)
        return {"type": "mesh", "points": points, "triangles": triangles, "bsdf": bsdf,
                "emitter": None if emission is None else {"radiance": {"value": emission}}}


def convert(path, width, height):
    """{"camera": ..., "parts": [...]}, numbers and lists only, in metres and Y up."""
    stage = Usd.Stage.Open(str(path))
    time = Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.Default()
    scene = _PlainConverter(stage, time).scene(width, height)
    sensor = scene.pop("sensor")
    parts = [_part(p) for p in scene.values() if isinstance(p, dict) and p["type"] in ("mesh", "sphere", "rectangle")]
    if len(parts) != len([p for p in scene.values() if isinstance(p, dict) and p["type"] != "path"]):
        raise NotComparable(f"{path}: a kind of light that is not converted")
    # Mitsuba's camera looks along +Z, Blender's along -Z.
    frame = np.array(sensor["to_world"].matrix) @ np.diag([-1.0, 1.0, -1.0, 1.0])
    return {"parts": parts, "camera": {"to_world": frame.tolist(), "fov": sensor["fov"], "near": sensor["near_clip"],
                                       "far": sensor["far_clip"]}}


def _part(part):
    emitter = part.get("emitter")
    common = {"kind": part["type"], "bsdf": part["bsdf"] if "color" in part["bsdf"] or part["bsdf"]["type"] == "mirror" else None,
              "emission": None if emitter is None else np.broadcast_to(emitter["radiance"]["value"], 3).tolist()}
    if part["type"] == "mesh":
        return {**common, "points": part["points"].tolist(), "triangles": part["triangles"].tolist()}
    if part["type"] == "sphere":
        return {**common, "center": list(part["center"]), "radius": part["radius"]}
    corners = np.array(part["to_world"].matrix) @ np.array([[-1, -1, 0, 1], [1, -1, 0, 1], [1, 1, 0, 1], [-1, 1, 0, 1]], float).T
    return {**common, "kind": "mesh", "points": corners[:3].T.tolist(), "triangles": [[0, 1, 2], [0, 2, 3]]}


def main():
    stage, width, height, output = sys.argv[1:]
    with open(output, "w") as file:
        json.dump(convert(stage, int(width), int(height)), file)


if __name__ == "__main__":
    main()
