"""Edits of the stability and scale suites: one that changed nothing would let its case pass."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from pxr import Usd, UsdGeom, UsdLux  # noqa: E402

import harness  # noqa: E402
from trilume_bench import rival, stages  # noqa: E402
from trilume_bench.suites import stability  # noqa: E402


def triangles(stage):
    """Corners (n, 3, 3) of all quads and triangles, in their meshes' space."""
    found = []
    for mesh in (UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)):
        points, indices = np.array(mesh.GetPointsAttr().Get()), np.array(mesh.GetFaceVertexIndicesAttr().Get())
        at = 0
        for count in mesh.GetFaceVertexCountsAttr().Get():
            face = points[indices[at:at + count]].astype(np.float64)
            found += [(face[0], face[k], face[k + 1]) for k in range(1, count - 1)]
            at += count
    return np.array(found)


def area(corners):
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


def edited(tmp_path, source, *edits):
    path = tmp_path / f"stage{len(edits)}.usda"
    stages.edited(harness.find_stage(source), path, *edits)
    return Usd.Stage.Open(str(path))


@pytest.mark.parametrize("name", [n for n, c in stability.CASES.items() if c.edits])
def test_every_case_is_another_stage(tmp_path, name):
    case = stability.CASES[name]
    texts = []
    for edits in (case.edits, ()):
        stages.edited(harness.find_stage(case.source), tmp_path / "stage.usda", *edits)
        texts.append((tmp_path / "stage.usda").read_text())
    assert texts[0] != texts[1]


def test_slivers_keep_surface_and_subsets(tmp_path):
    before, after = edited(tmp_path, "cornell_glass"), edited(tmp_path, "cornell_glass", stages.slivers(1e3))
    assert len(triangles(after)) == 2 * len(triangles(before))
    assert area(triangles(after)) == pytest.approx(area(triangles(before)), rel=1e-5)
    longest = max(np.linalg.norm(np.diff(t, axis=0), axis=1).max() for t in triangles(after))
    assert min(np.linalg.norm(t[1] - t[0]) for t in triangles(after)) < 2e-3 * longest
    room = UsdGeom.Mesh(after.GetPrimAtPath("/World/Room"))
    faces = [i for s in UsdGeom.Subset.GetAllGeomSubsets(room) for i in s.GetIndicesAttr().Get()]
    assert sorted(faces) == list(range(len(room.GetFaceVertexCountsAttr().Get())))


def test_doubled_meshes_stand_twice(tmp_path):
    before, after = edited(tmp_path, "cornell_glass"), edited(tmp_path, "cornell_glass", stages.doubled)
    assert np.sort(triangles(after).ravel()).tolist() == np.sort(np.repeat(triangles(before).ravel(), 2)).tolist()


def test_two_lamps_have_equal_power(tmp_path):
    stage = edited(tmp_path, "one_box", *stability.CASES["lamps whose radiances differ by 1e8"].edits)
    lamps = [UsdLux.SphereLight(p) for p in stage.Traverse() if p.IsA(UsdLux.SphereLight)]
    radiances = [lamp.GetIntensityAttr().Get() for lamp in lamps]
    powers = [r * lamp.GetRadiusAttr().Get() ** 2 for r, lamp in zip(radiances, lamps)]
    assert max(radiances) / min(radiances) == pytest.approx(1e8, rel=1e-3) and powers[0] == pytest.approx(powers[1], rel=1e-3)


def test_hall_has_what_was_asked_for(tmp_path):
    stages.hall(tmp_path / "hall.usda", lamps=37, instances=11, triangles=1000)
    stage = Usd.Stage.Open(str(tmp_path / "hall.usda"))
    assert sum(p.IsA(UsdLux.SphereLight) for p in stage.Traverse()) == 37
    assert len(UsdGeom.PointInstancer(stage.GetPrimAtPath("/World/Balls")).GetPositionsAttr().Get()) == 11
    corners = triangles(stage)[12:]
    assert 900 < len(corners) < 1100 and area(corners) == pytest.approx(4 * np.pi, rel=0.02)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.linalg.norm(outward, axis=1) > 0).all() and ((outward * corners.mean(axis=1)).sum(axis=1) > 0).all()


@pytest.mark.parametrize("name, count", [("box", 32), ("fine_box", 96_000)])
def test_boxes_have_as_many_triangles_as_they_say(tmp_path, name, count):
    """The lamp's rectangle are two more."""
    class Content:
        stage = staticmethod(harness.find_stage)

    rival.STAGES[name](Content, tmp_path / "box.usda")
    stage = Usd.Stage.Open(str(tmp_path / "box.usda"))
    assert len(triangles(stage)) + 2 == pytest.approx(count, rel=0.01)
    # Standing on the floor, in the room, and seen from outside.
    for path in ("/World/Tall", "/World/Short" if name == "box" else "/World/Ball"):
        bounds = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(stage.GetPrimAtPath(path)).ComputeAlignedRange()
        assert bounds.GetMin()[1] == pytest.approx(0, abs=1e-6) and abs(bounds.GetMin()[0]) < 1.6 and bounds.GetMax()[1] < 1.8
