"""What every technique must stand: scenes that leave it nothing to do or too much, and invariances."""

import json

import numpy as np
import pytest
from pxr import Usd, UsdGeom, Vt

import harness
from trilume_bench import metrics
from harness import CAMERA, GLASS, LAMP, matte, mesh, write_stage

TECHNIQUES = {t["name"]: t for t in json.loads((harness.ROOT / "plugins/techniques.json").read_text())}
# All nodes are in these; one by one where there is time.
CHECKED = TECHNIQUES if harness.FULL else ("restir_bpt", "hybrid")
WARMUP = ("--warmup", 2)

FLOOR = mesh(points="[(-9, -1, -9), (9, -1, -9), (9, -1, 9), (-9, -1, 9)]", indices="[3, 2, 1, 0]", name="Floor")

CLOSED_BOX = mesh(
    points=str([(x, y, z + 4) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]),
    counts="[4, 4, 4, 4, 4, 4]",
    indices="[0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]", name="Box")



def ball(name, position, radius, material="Glass"):
    return f"""
    def Sphere "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        double radius = {radius}
        rel material:binding = </World/{material}>
        double3 xformOp:translate = {position}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""


def many_emissive_triangles(path):
    """100,000 of them in a wavy carpet that glows, over which a square hangs."""
    stage = Usd.Stage.Open(str(write_stage(path, CAMERA, mesh(), matte(0.8), matte(0, 1.0, "Glow"))))
    columns, rows = 250, 200
    x, z = np.meshgrid(np.linspace(-4, 4, columns + 1), np.linspace(-4, 4, rows + 1))
    points = np.stack([x, 0.1 * np.sin(7 * x) * np.cos(5 * z) - 1.5, z], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    low = np.stack([corner, corner + columns + 1, corner + 1], axis=-1)
    high = np.stack([corner + 1, corner + columns + 1, corner + columns + 2], axis=-1)
    indices = np.concatenate([low, high]).astype(np.int32)
    carpet = UsdGeom.Mesh.Define(stage, "/World/Carpet")
    carpet.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    carpet.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(indices), 3, np.int32)))
    carpet.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(indices.ravel()))
    carpet.CreateSubdivisionSchemeAttr("none")
    carpet.GetPrim().ApplyAPI("MaterialBindingAPI")
    carpet.GetPrim().CreateRelationship("material:binding").SetTargets(["/World/Glow"])
    stage.GetRootLayer().Save()
    return path


SCENES = {
    "no_light": lambda p: write_stage(p, CAMERA, mesh(), FLOOR, matte()),
    "black": lambda p: write_stage(p, CAMERA, mesh(), FLOOR, LAMP, matte(0)),
    "one_triangle": lambda p: write_stage(
        p, CAMERA, mesh("[(-1, -1, 0), (1, -1, 0), (0, 1, 0)]", "[3]", "[0, 1, 2]"), LAMP, matte()),
    "many_emissive_triangles": many_emissive_triangles,
    "camera_in_a_wall": lambda p: write_stage(p, CAMERA, mesh(), FLOOR, CLOSED_BOX, LAMP, matte()),
    "camera_in_glass": lambda p: write_stage(
        p, CAMERA, mesh(), FLOOR, ball("Ball", "(0, 0, 4)", 0.5), LAMP, matte(), GLASS),
    "lamp_in_glass": lambda p: write_stage(
        p, CAMERA, mesh(), FLOOR, ball("Ball", "(1, 2, 3)", 0.5), LAMP, matte(), GLASS),
}
DARK = ("no_light", "black", "camera_in_a_wall")


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("technique", CHECKED)
def test_extreme_scene(render, tmp_path, technique, scene):
    """A finite picture, and nothing that had to be dropped."""
    stage = SCENES[scene](tmp_path / "stage.usda")
    result = render(stage, "-t", technique, *WARMUP, "--spp", 2, "--default-light", "off")
    frame, = result.stats["frames"]
    assert frame["nonfinite"] == 0
    assert (result.image >= 0).all()
    if scene in DARK:
        # The lamp itself may be in the picture.
        assert (result.image[harness.SIZE[1] // 2:] == 0).all()
    elif scene != "lamp_in_glass" or "caustic" not in frame["unowned"]:
        assert result.image.mean() > 0


@pytest.mark.parametrize("technique", CHECKED)
def test_same_seed_same_image(render, technique):
    options = ("-t", technique, *WARMUP, "--spp", 2)
    one = render("cornell_glass", *options, env={"LP_NUM_THREADS": "1"})
    two = render("cornell_glass", *options, env={"LP_NUM_THREADS": "2"})
    assert np.array_equal(one.image, two.image)


@pytest.mark.parametrize("technique", [name for name in CHECKED if not TECHNIQUES[name].get("overlapping")])
def test_path_classes_have_one_owner_at_most(render, technique):
    """And those without one are named."""
    frame, = render("cornell_glass", "-t", technique, *WARMUP, "--spp", 2, env={"LP_NUM_THREADS": "2"}).stats["frames"]
    expected = {"raytrace": ["caustic", "indirect"], "restir": ["caustic", "indirect"], "ddgi": ["caustic"],
                "ddgi_restir": ["caustic"]}
    assert frame["unowned"] == expected.get(technique, [])


def test_classes_of_an_overlapping_technique_add_up(render):
    """Two nodes carry some of them: an AOV is the sum of both, as the picture is."""
    result = render("cornell_empty", "-t", "ddgi_restir_bpt", aovs=("emission", *harness.CLASSES))
    assert sum(result.aovs.values()) == pytest.approx(result.image, rel=1e-4, abs=1e-5)
    assert result.aovs["indirect"].mean() > 0.01
