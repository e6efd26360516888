"""Irradiance probes: exact solutions, agreement with path tracing, sleep and waking."""

import json

import numpy as np
import pytest

import bpt_stages
import harness
from trilume_bench import metrics

DDGI = ("-t", "ddgi")
# Enough for rooms, and quick.
FEW = ("--set", "ddgi.probes=300", "--set", "ddgi.tolerance=0")


def indirect(render, stage, *options):
    """(picture of the indirect class, statistics)."""
    run = render(stage, *options, aovs=("indirect",))
    return run.aovs["indirect"], run.stats["frames"][-1]


def room(scale=1.0):
    """A cube seen from within."""
    return harness.mesh(str([(scale * x, scale * y, scale * z) for z in (-2, 2) for y in (-2, 2) for x in (-2, 2)]),
                        "[4, 4, 4, 4, 4, 4]",
                        "[0, 4, 5, 1, 2, 3, 7, 6, 0, 1, 3, 2, 0, 2, 6, 4, 1, 5, 7, 3, 4, 6, 7, 5]", name="Room")


def camera(scale=1.0):
    place = tuple(scale * c for c in (0.3, 0.2, 1.5))
    return harness.CAMERA.replace("(0, 0, 4)", str(place)).replace("(0.01, 1000)", "(1e-6, 1e9)")


def lamp(name, place, intensity):
    return f"""
    def SphereLight "{name}"
    {{
        float inputs:radius = 0.2
        float inputs:intensity{intensity}
        double3 xformOp:translate = {place}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""


# ---- exact solutions ---------------------------------------------------------------------------

def furnace(folder, albedo=0.6, scale=1.0, emission=1.0):
    return harness.write_stage(folder / "furnace.usda", camera(scale), room(scale), harness.matte(albedo, emission))


@pytest.mark.parametrize("gather, volumes", [("probe", 1), ("probe", 3), ("final", 1)])
def test_closed_furnace(render, tmp_path, gather, volumes):
    """Emission 1 and albedo 0.6 everywhere: rho^2 / (1 - rho) of two and more bounces. Light samples of the six walls have a
    standard deviation near 1; 8000 rays a round, and 250 rounds that weigh as 80, leave 0.0013 of it, 2.5 times that with
    all bounces; 64 rays for each of 576 pixels leave 0.005 of one bounce, of which light samples are four tenths."""
    options = (*DDGI, *FEW, "--warmup", 250, "--spp", 4 if gather == "probe" else 64, "--set", f"ddgi.gather={gather}",
               "--set", f"ddgi.volumes={volumes}", "--set", "ddgi.settledShare=1")
    picture, _ = indirect(render, furnace(tmp_path), *options)
    assert picture.mean() == pytest.approx(0.36 / 0.4, rel=0.01)
    assert metrics.block_means(picture, 6) == pytest.approx(0.36 / 0.4, rel=0.05)


@pytest.mark.parametrize("volumes", [1, 3])
def test_all_bounces_between_bright_walls_at_once(render, tmp_path, volumes):
    """Albedo 0.9, the first frame: twelve bounces by themselves find 0.75 of the light."""
    pictures = render.seeds(furnace(tmp_path, albedo=0.9), *DDGI, *FEW, "--denoise", "off",
                            "--set", f"ddgi.volumes={volumes}", count=4)
    indirect = pictures.mean() - 1 - 0.9  # what is emitted, and its first bounce, both the same everywhere
    assert indirect == pytest.approx(0.81 / 0.1, rel=0.05)


@pytest.mark.parametrize("scale, emission", [(1e-3, 1), (1e3, 1), (1, 1e-5), (1, 1e5)])
def test_scaled_furnace(render, tmp_path, scale, emission):
    """The same image, or the same times the emission."""
    options = (*DDGI, *FEW, "--warmup", 2)
    expected, _ = indirect(render, furnace(tmp_path), *options)
    (tmp_path / "scaled").mkdir()
    picture, _ = indirect(render, furnace(tmp_path / "scaled", scale=scale, emission=emission), *options)
    # A factor that is no power of two rounds differently; a ray in a few thousand then goes another way.
    assert np.median(np.abs(picture / emission / expected - 1)) < 1e-3
    assert picture.mean() / emission == pytest.approx(expected.mean(), rel=5e-3)


# ---- agreement ---------------------------------------------------------------------------------

STAGES = ("cornell_empty", "cornell_big_light", "cornell_light_sphere", "one_box") if harness.FULL else ("one_box",)


@pytest.mark.parametrize("gather, spp", [("probe", 4), ("final", 128)])
@pytest.mark.parametrize("stage", STAGES)
def test_agrees_with_path_tracing(render, stage, gather, spp):
    """The class's mean within 3% by probes at the visible point, within 2% by final gather. (White_room and cornell_glass
    lack the light of their mirrors and glass, which the caustics node brings.)"""
    expected, _ = indirect(render, stage, "-t", "pathtrace", "--spp", 1024)
    picture, frame = indirect(render, stage, *DDGI, "--warmup", 16, "--spp", spp, "--set", f"ddgi.gather={gather}",
                              "--set", "ddgi.probes=2048")
    assert frame["nonfinite"] == 0
    assert metrics.mean_ratio(picture, expected) == pytest.approx(1, abs=0.03 if gather == "probe" else 0.02)


@pytest.mark.skipif(not harness.FULL, reason="a minute: TRILUME_FULL=1")
def test_five_boxes_are_as_bright_as_one(render):
    """The paper's darkening test; and with its choice of lights, a fifth is left of each bounce's direct light."""
    options = (*DDGI, "--warmup", 16, "--spp", 32, "--set", "ddgi.probes=1500")
    one, _ = indirect(render, "one_box", *options)
    five, _ = indirect(render, "five_boxes", *options)
    assert five.mean() / one.mean() == pytest.approx(1, abs=0.03)
    dark, _ = indirect(render, "five_boxes", *options, "--set", "light.selection=uncompensated")
    assert dark.mean() / five.mean() == pytest.approx(0.2, rel=0.03)


def test_light_through_frosted_glass(render, tmp_path):
    """A pane of rough glass before a lamp and a wall: rays go on through both its faces. (What probes hold of it is noisy, and
    roots take noise for darkness.)"""
    stage = bpt_stages.make_stage(tmp_path / "frosted.usda", camera=(0, 1, 4.5))
    bpt_stages.room(stage)
    frosted = bpt_stages.material(stage, "Frosted", diffuseColor=(0.9, 1, 0.9), ior=1.5, opacity=0.0, roughness=0.3)
    corners = [(x, y, z) for z in (0.95, 1.05) for y in (0.4, 1.6) for x in (-0.8, 0.8)]
    bpt_stages.mesh(stage, "Pane", corners, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
                    frosted)
    bpt_stages.light(stage, "SphereLight", "Lamp", 40, (0, 1, -1), radius=0.2)
    stage.Save()
    expected, _ = indirect(render, stage.GetRootLayer().realPath, "-t", "pathtrace", "--spp", 2048)
    picture, _ = indirect(render, stage.GetRootLayer().realPath, *DDGI, "--warmup", 16, "--spp", 256)
    pane = (slice(4, 14), slice(11, 21))
    assert picture[pane].mean() == pytest.approx(expected[pane].mean(), rel=0.06)
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.05)


def room_of_sheets(stage, wall, floor=None, rim=0.0):
    """Four by 2.5 by 6.7 metres, of six sheets that stick out by `rim` beyond their edges."""
    low, high = np.array([-2, 0, -2.5]), np.array([2, 2.5, 4.2])
    for axis in range(3):
        across = [other for other in range(3) if other != axis]
        for side, plane in (("Low", low), ("High", high)):
            corners = np.tile(plane.astype(float), (4, 1))
            corners[:, across[0]] = [low[across[0]] - rim, high[across[0]] + rim, high[across[0]] + rim, low[across[0]] - rim]
            corners[:, across[1]] = [low[across[1]] - rim, low[across[1]] - rim, high[across[1]] + rim, high[across[1]] + rim]
            inward = (side == "Low") != (axis == 1)
            bpt_stages.mesh(stage, f"Wall{axis}{side}", corners, [[0, 1, 2, 3] if inward else [3, 2, 1, 0]],
                            floor if floor and axis == 1 and side == "Low" else wall)


def indirect_by_both(render, stage, *options):
    """The indirect class by probes and by path tracing."""
    stage.Save()
    path = stage.GetRootLayer().realPath
    picture, _ = indirect(render, path, *DDGI, "--warmup", 16, "--spp", 16, *options)
    return picture, indirect(render, path, "-t", "pathtrace", "--spp", 1024)[0]


@pytest.mark.parametrize("rim", [0, 0.05])
def test_walls_without_thickness_keep_the_light_of_the_sky_out(render, tmp_path, rim):
    """Where walls stick out beyond the corners, a plane of probes stands just outside of them, and sees their lit backs."""
    stage = bpt_stages.make_stage(tmp_path / "sheets.usda", camera=(0, 1.2, 3.8))
    room_of_sheets(stage, bpt_stages.material(stage, "White", diffuseColor=(0.7, 0.7, 0.7)), rim=rim)
    bpt_stages.light(stage, "SphereLight", "Lamp", 20, (0.4, 2.1, -0.2), radius=0.2)
    bpt_stages.light(stage, "DomeLight", "Sky", 1)
    picture, expected = indirect_by_both(render, stage)
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.15)


def test_what_a_shiny_floor_reflects_leaves_no_stains(render, tmp_path):
    """Light samples seldom find a lamp in brushed metal, and it is bright where they do: 9% of what walls show, without care."""
    stage = bpt_stages.make_stage(tmp_path / "metal.usda", camera=(0, 1.2, 3.8))
    metal = bpt_stages.material(stage, "Metal", diffuseColor=(0.9, 0.8, 0.6), metallic=1.0, roughness=0.2)
    room_of_sheets(stage, bpt_stages.material(stage, "White", diffuseColor=(0.7, 0.7, 0.7)), metal)
    bpt_stages.light(stage, "RectLight", "Lamp", 12, (0.8, 2.4, 0.3), (-90, 0, 0), width=0.9, height=0.6)
    picture, expected = indirect_by_both(render, stage)
    walls = metrics.block_means(picture[:6], 3) / metrics.block_means(expected[:6], 3) - 1
    assert np.sqrt(np.mean(np.square(walls))) < 0.065


def test_a_bright_caustic_leaves_no_blots_on_walls(render):
    """Few rays of a probe meet the spot below a glass ball; were it known by them alone, runs would differ four times as much."""
    options = ("--warmup", 24, "--spp", 64, "--denoise", "off")
    pictures = [render("cornell_glass", "-t", "hybrid", *options, "--seed", seed, size=(48, 27), aovs=("indirect",)).aovs["indirect"]
                for seed in range(4)]
    mean = np.mean(pictures, axis=0)
    assert np.mean([metrics.relmse(p, mean) for p in pictures]) < 0.0018


def test_the_shaded_side_of_a_lampshade(render, tmp_path):
    """The back of a sheet that no lamp shines at, lit by the room."""
    stage = bpt_stages.make_stage(tmp_path / "shade.usda", camera=(0, 1, 3), look_down=0)
    white = bpt_stages.material(stage, "White", diffuseColor=(0.7, 0.7, 0.7))
    room_of_sheets(stage, white)
    bpt_stages.mesh(stage, "Shade", [(-1.2, 1.5, 0.8), (1.2, 1.5, 0.8), (1.2, 1.5, -1.2), (-1.2, 1.5, -1.2)], [[0, 1, 2, 3]], white)
    bpt_stages.light(stage, "SphereLight", "Lamp", 120, (0, 2.2, -0.2), radius=0.1)
    picture, expected = indirect_by_both(render, stage)
    shade = (slice(5, 7), slice(10, 22))
    assert picture[shade].mean() == pytest.approx(expected[shade].mean(), rel=0.25)
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.06)


def test_probes_have_their_places_after_the_first_frame(render, tmp_path):
    """One that is still on its way serves nobody, and at rest it would be for hundreds of frames. Rims put a plane of them
    behind the walls."""
    stage = bpt_stages.make_stage(tmp_path / "sheets.usda", camera=(0, 1.2, 3.8))
    room_of_sheets(stage, bpt_stages.material(stage, "White", diffuseColor=(0.7, 0.7, 0.7)), rim=0.02)
    bpt_stages.light(stage, "SphereLight", "Lamp", 20, (0.4, 2.1, -0.2), radius=0.2)
    stage.Save()
    _, first = indirect(render, stage.GetRootLayer().realPath, *DDGI)
    _, later = indirect(render, stage.GetRootLayer().realPath, *DDGI, "--warmup", 32, "--set", "ddgi.settledShare=1")
    assert first["probes"]["active"] == pytest.approx(later["probes"]["active"], rel=0.01)


def test_resampled_lights_bring_what_lights_bring(render, tmp_path):
    """Probe rays choose among lights by where these stand. Nearly black surfaces leave one bounce of direct light, which one
    ray of final gather meets: its mean is path tracing's. One in a thousand is left to the probes. Lights of all kinds, near
    and far, large and small, one of them turned away from all but the floor, one below the horizon of most places."""

    def light(kind, name, place, **inputs):
        rows = "".join(f"        float inputs:{k} = {v}\n" for k, v in inputs.items())
        return f"""
    def {kind} "{name}"
    {{
{rows}        double3 xformOp:translate = {place}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""
    floor = harness.mesh("[(-3, -1, 3), (3, -1, 3), (3, -1, -3), (-3, -1, -3)]", name="Floor")
    wall = harness.mesh("[(-3.2, -1.3, -2.1), (3.2, -1.3, -2.1), (3.2, 3, -2.1), (-3.2, 3, -2.1)]", name="Wall")
    shiny = harness.mesh("[(-2, 0.2, -1), (-1, 0.2, -1), (-1, 0.9, -1.3), (-2, 0.9, -1.3)]", name="Panel", material="Glow")
    stage = harness.write_stage(
        tmp_path / "lights.usda", harness.CAMERA, floor, wall, shiny, harness.matte(0.03),
        harness.matte(0.03, 6.0, name="Glow"), light("SphereLight", "Sphere", "(1, 0.5, -1)", radius=0.1, intensity=60),
        light("RectLight", "Rect", "(0, 2, 0.5)", width=1, height=0.5, intensity=10),
        light("DiskLight", "Disk", "(-1, -0.4, -1.6)", radius=0.2, intensity=30),
        light("CylinderLight", "Cylinder", "(0.4, -1.2, -2.6)", radius=0.05, length=1, intensity=50),
        light("DistantLight", "Sun", "(0, 0, 0)", angle=2, intensity=500),
        light("DomeLight", "Sky", "(0, 0, 0)", intensity=0.3))

    def pictures(*options):
        return [indirect(render, stage, "--default-light", "off", "--seed", seed, *options)[0] for seed in range(4)]

    expected = pictures("-t", "pathtrace", "--spp", 1024)
    found = pictures(*DDGI, "--set", "ddgi.gather=final", "--set", "ddgi.probes=300", "--spp", 256)
    mean, error = metrics.confidence([p.mean() for p in expected])
    other, spread = metrics.confidence([p.mean() for p in found])
    assert np.hypot(error, spread) < 0.01 * mean
    assert abs(other - mean) < 3.5 * np.hypot(error, spread) + 0.002 * mean


# ---- what a scene does not need, and what changes ----------------------------------------------

@pytest.mark.parametrize("parts, reason", [
    ((harness.matte(0.6),), "no lights"),
    ((harness.matte(0), harness.LAMP), "nothing reflects diffusely"),
])
def test_is_skipped_where_there_is_nothing_to_do(render, tmp_path, parts, reason):
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), *parts)
    frame, = render(stage, *DDGI, "--default-light", "off").stats["frames"]
    node, = (n for n in frame["nodes"] if n["name"] == "ddgi")
    assert (node["state"], node["reason"]) == ("skipped", reason)


def play(folder, stage, frames, *options):
    """(indirect light as pictures, probe statistics) of the frames; no lamp is in the picture."""
    done = harness.run("render", "--imageWidth", 32, "--imageHeight", 18, *DDGI, "--disable", "raytrace",
                       "--denoise", "off", "-f", frames, "--stats", folder / "stats.json", *options, stage,
                       folder / "out.####.pfm")
    assert done.status == 0, done.stderr
    stats = json.loads((folder / "stats.json").read_text())["frames"]
    return [metrics.read_image(folder / f"out.{int(f['frame']):04d}.pfm") for f in stats], [f["probes"] for f in stats]


ABOVE = ("(0.8, 1.3, 0.3)", "(-0.8, 1.3, 0.3)")


def test_converged_probes_sleep(tmp_path):
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), harness.matte(0.6),
                                lamp("Lamp", ABOVE[0], " = 20"))
    pictures, probes = play(tmp_path, stage, "1:3", "--spp", 150, "--set", "ddgi.probes=300", "--set",
                            "ddgi.tolerance=0.1")
    assert 0 < probes[0]["active"] < probes[0]["total"]
    assert probes[0]["updated"] > 50 * probes[0]["active"]
    # One in 32 of them each frame.
    assert probes[2]["updated"] < 150 * probes[2]["total"] / 24
    assert pictures[2].mean() == pytest.approx(pictures[0].mean(), rel=0.03)


def test_what_pixels_keep_while_all_stands_goes_when_the_camera_moves(tmp_path):
    """Twelve frames from one place, then one from another, where pixels show other places on the same triangles."""
    moving = camera().replace("xformOp:translate = (0.3, 0.2, 1.5)", "xformOp:translate.timeSamples = "
                              "{ 1: (0.3, 0.2, 1.5), 2: (-1.5, -1.2, 0.2) }")
    stage = harness.write_stage(tmp_path / "stage.usda", moving, room(), harness.matte(0.6),
                                lamp("Lamp", "(-1, 1.2, -1)", " = 20"))
    options = ("--set", "ddgi.probes=600", "--warmup", 12)
    before, after = play(tmp_path, stage, "1:2", *options)[0]
    alone, = play(tmp_path, stage, "2", *options)[0]
    assert metrics.relmse(before, alone) > 0.03
    assert metrics.relmse(after, alone) < 0.002


def test_what_pixels_keep_follows_the_camera(tmp_path):
    """After a walk of 24 frames the picture is that of a camera that stood at its end."""
    def last(name, place):
        stage = harness.write_stage(tmp_path / name, camera().replace("xformOp:translate = (0.3, 0.2, 1.5)", f"xformOp:translate{place}"),
                                    room(), harness.matte(0.6), lamp("Lamp", "(-1, 1.2, -1)", " = 20"))
        return play(tmp_path, stage, "1:24", "--set", "ddgi.probes=600")[0]

    walk = last("walk.usda", ".timeSamples = { 1: (0.3, 0.2, 1.5), 24: (-1.5, -1.2, 0.2) }")
    stood = last("stood.usda", " = (-1.5, -1.2, 0.2)")
    assert metrics.relmse(walk[0], stood[0]) > 0.03
    assert metrics.relmse(walk[-1], stood[-1]) < 0.002
    assert walk[-1].mean() == pytest.approx(stood[-1].mean(), rel=0.005)


def test_light_that_is_switched_off_is_gone_in_a_few_frames(tmp_path):
    """A thousandth is left of the light; after 16 frames of one update each, a fiftieth at most of what was."""
    off = ".timeSamples = { 1: 50, 20: 50, 21: 0 }"
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), harness.matte(0.6),
                                lamp("Lamp", ABOVE[0], off), lamp("Other", ABOVE[1], " = 0.05"))
    means = [p.mean() for p in play(tmp_path, stage, "1:36", "--set", "ddgi.probes=300", "--warmup", 1)[0]]
    assert means[19] == pytest.approx(means[0], rel=0.25)
    assert means[35] < 0.02 * means[19], means[19:]


def test_a_ball_that_leaves_the_room_takes_no_probes_along(tmp_path):
    """It grows the scene's bounds in every frame; the grid begins anew at most twice, and the room stays as bright."""
    ball = '''def Sphere "Ball" {
        double radius = 0.1
        double3 xformOp:translate.timeSamples = { 1: (0, 1, 0), 24: (0, 8, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
'''
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), ball, harness.matte(0.6),
                                lamp("Lamp", ABOVE[0], " = 20"))
    pictures, probes = play(tmp_path, stage, "1:24", "--set", "ddgi.probes=600")
    assert sum(p["updated"] > 5 * p["total"] for p in probes[1:]) <= 2, probes
    assert pictures[-1].mean() == pytest.approx(pictures[0].mean(), rel=0.1)


def test_what_pixels_keep_goes_when_the_grid_begins_anew(tmp_path):
    """The lamp goes out as a ball leaves the room: nothing is left of its light, in probes or in pixels."""
    ball = '''def Sphere "Ball" {
        double radius = 0.1
        double3 xformOp:translate.timeSamples = { 1: (0, 1, 0), 8: (0, 1, 0), 9: (0, 60, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
'''
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), ball, harness.matte(0.6),
                                lamp("Lamp", ABOVE[0], ".timeSamples = { 1: 20, 8: 20, 9: 0 }"),
                                lamp("Other", ABOVE[1], " = 0.01"))
    pictures = play(tmp_path, stage, "1:9", "--set", "ddgi.probes=600", "--warmup", 60)[0]
    assert pictures[8].max() < 0.01 * pictures[7].min()


def test_probes_follow_a_moving_wall(tmp_path):
    """A wall slides between lamp and camera; 20 frames later nine tenths at least of the difference are gone."""
    wall = harness.mesh("[(-1.9, -1.9, 0), (1.9, -1.9, 0), (1.9, 1.9, 0), (-1.9, 1.9, 0)]", name="Wall", extra="""
        double3 xformOp:translate.timeSamples = { 1: (0, 3.6, -0.5), 20: (0, 3.6, -0.5), 24: (0, 0, -0.5) }
        uniform token[] xformOpOrder = ["xformOp:translate"]""")
    stage = harness.write_stage(tmp_path / "stage.usda", camera(), room(), wall, harness.matte(0.6),
                                lamp("Lamp", "(0.8, 1.3, -1.2)", " = 20"), lamp("Other", ABOVE[1], " = 1"))
    options = ("--set", "ddgi.probes=600", "--set", "ddgi.budget=65536", "--warmup", 1)
    played = play(tmp_path, stage, "1:44", *options)[0]
    alone = play(tmp_path, stage, "44", "--set", "ddgi.probes=600", "--warmup", 30)[0][0]
    before, after, expected = played[18].mean(), played[-1].mean(), alone.mean()
    assert expected < 0.5 * before
    assert abs(after - expected) < 0.1 * (before - expected)


@pytest.mark.parametrize("stage", ["five_boxes", "white_room"])
def test_voxels_found_empty_without_rays_are_of_no_use(render, stage):
    """Ray queries do not tell which voxels are empty, so that all probes send rays. The same ones serve, but for rays that
    end elsewhere by rounding, and the light is the same; a probe that is missing leaves its surroundings to others, or dark."""
    options = (*DDGI, "--set", "ddgi.probes=1000")
    own, frame = indirect(render, stage, *options, "--tracer", "compute")
    other, all_send = indirect(render, stage, *options, "--tracer", "query")
    assert frame["probes"]["updated"] < all_send["probes"]["updated"]
    assert frame["probes"]["active"] == pytest.approx(all_send["probes"]["active"], rel=0.01)
    assert metrics.mean_ratio(own, other) == pytest.approx(1, abs=0.01)


def estate(folder, name, place):
    """Two closed rooms 60 m apart, each with its lamp, and balls far away; the camera is at `place`."""
    def at(x):
        return f"""
        double3 xformOp:translate = ({x}, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]"""

    def ball(name, place):
        return f'''
    def Sphere "{name}" {{
        double radius = 0.5
        double3 xformOp:translate = {place}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
'''
    other = room().replace('"Room"', '"Other"').rstrip().removesuffix("}") + at(60) + "\n    }\n"
    return harness.write_stage(folder / name, camera().replace("xformOp:translate = (0.3, 0.2, 1.5)", f"xformOp:translate{place}"),
                               room(), other, ball("Near", "(-240, -240, -240)"), ball("Far", "(240, 240, 240)"),
                               harness.matte(0.6), lamp("Lamp", ABOVE[0], " = 20"), lamp("Second", "(60.8, 1.3, 0.3)", " = 20"))


def test_finer_grids_follow_the_camera(tmp_path):
    """A room in a large scene looks as it does alone, where the scene's own grid has one probe in 28 m; so does the next one
    after a walk of 40 frames, and after a jump. Few rays leave 2% of the mean from seed to seed, and what a jump comes to has six
    bounces, 0.6^6 less than all."""
    alone = harness.write_stage(tmp_path / "alone.usda", camera(), room(), harness.matte(0.6), lamp("Lamp", ABOVE[0], " = 20"))
    expected, = play(tmp_path, alone, "1", "--warmup", 32, "--spp", 16)[0]
    fine = ("--set", "ddgi.volumes=4")

    def expect_likeness(stage, frames):
        picture = play(tmp_path, stage, frames, *fine)[0][-1]
        assert metrics.relmse(picture, expected) < 0.01
        assert picture.mean() == pytest.approx(expected.mean(), rel=0.05 + 3 * 0.02)

    inside = estate(tmp_path, "inside.usda", " = (0.3, 0.2, 1.5)")
    coarse, = play(tmp_path, inside, "1")[0]
    assert metrics.relmse(coarse, expected) > 0.1
    expect_likeness(inside, "1")
    there = "(60.3, 0.2, 1.5)"
    expect_likeness(estate(tmp_path, "walk.usda", f".timeSamples = {{ 1: (0.3, 0.2, 1.5), 40: {there} }}"), "1:40")
    expect_likeness(estate(tmp_path, "jump.usda", f".timeSamples = {{ 1: (0.3, 0.2, 1.5), 2: {there} }}"), "1:2")


def test_probes_follow_a_moving_lamp(tmp_path):
    """A lamp crosses a room within a second while another fades; the light at the end is that of the end, as seen alone."""
    means = []
    for frames in ("1:24", "24"):
        done = harness.run("render", "--imageWidth", 64, "--imageHeight", 36, *DDGI, "--denoise", "off", "-f", frames,
                           "--aov", f"indirect={tmp_path / 'indirect.####.pfm'}", harness.CONTENT / "animated.usda",
                           tmp_path / "out.####.pfm")
        assert done.status == 0, done.stderr
        means.append(metrics.read_image(tmp_path / "indirect.0024.pfm").mean())
    assert means[0] == pytest.approx(means[1], rel=0.12)
