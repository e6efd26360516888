"""Stages as other renderers get them."""

import importlib.util

import numpy as np
import pytest

import harness

if importlib.util.find_spec("mitsuba") is None:
    pytest.skip("Mitsuba is not installed", allow_module_level=True)

from trilume_bench import usd_to_cycles  # noqa: E402


def test_cycles_gets_parts_and_camera():
    scene = usd_to_cycles.convert(harness.find_stage("cornell_glass"), 96, 54)
    kinds = [p["kind"] for p in scene["parts"]]
    assert set(kinds) == {"mesh", "sphere"}
    glass = [p["bsdf"] for p in scene["parts"] if p["bsdf"] and p["bsdf"]["type"] == "glass"]
    assert glass and all(b["ior"] == pytest.approx(1.5) for b in glass)
    lamp, = (p for p in scene["parts"] if p["emission"])
    a, b, c = (np.array(lamp["points"][k]) for k in lamp["triangles"][0])
    assert np.cross(b - a, c - a)[1] < 0, "the lamp below the ceiling shines down"
    frame = np.array(scene["camera"]["to_world"])
    assert np.allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3)) and np.linalg.det(frame[:3, :3]) == pytest.approx(1)
    assert frame[2, 3] > 0 and frame[2, 2] == pytest.approx(1), "it looks along -Z into the box"
