"""Path tracing and ray tracing: convergence, exact solutions, invariances. Agreement with Mitsuba: tests/image."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import harness
from trilume_bench import metrics

PATHTRACE = ("-t", "pathtrace")
RAYTRACE = ("-t", "raytrace")


# ---- convergence -------------------------------------------------------------------------------

# All but the strongly caustic ones; name: (options, reference).
CONVERGING = {
    "cornell_empty": ((), "cornell_empty"), "cornell_big_light": ((), "cornell_big_light"),
    "cornell_light_sphere": ((), "cornell_light_sphere"), "one_box": ((), "one_box"), "five_boxes": ((), "one_box"),
    "maze": ((), "maze"), "white_room": ((), "white_room"), "animated": (("--frames", 12), "animated.0012"),
}


@pytest.mark.parametrize("stage", CONVERGING if harness.FULL else ("cornell_empty", "cornell_light_sphere"))
def test_error_halves_as_samples_double(render, stage):
    """relMSE ~ samples^-1 over 16 to 4096; stratified samples may do better, never worse than noise allows.

    A relMSE is the mean of 1728 squared residuals; with a kurtosis of 10 its relative error is sqrt(9/1728) = 7%, and that
    of the slope over ln(256) at five points 0.07 / 4.4 = 0.016: a bound of -0.92 is five of those away.
    """
    options, name = CONVERGING[stage]
    reference = harness.reference(name)
    samples = [16, 64, 256, 1024, 4096]
    # Seed by seed, so that the runs are independent.
    errors = [metrics.relmse(render(stage, *PATHTRACE, *options, "--spp", n, "--seed", 100 + n).image, reference.image)
              for n in samples]
    slope = metrics.slope(samples, np.array(errors) - reference.relmse)
    print(f"{stage}: relMSE {', '.join(f'{e:.2g}' for e in errors)} at {samples} spp (reference {reference.relmse:.2g}), "
          f"slope {slope:.3f}")
    assert errors[-1] < 1e-3
    assert slope < -0.92, errors


# ---- exact solutions ---------------------------------------------------------------------------

INSIDE_OUT_CUBE = dict(
    points=str([(x, y, z) for z in (-2, 2) for y in (-2, 2) for x in (-2, 2)]),
    counts="[4, 4, 4, 4, 4, 4]",
    indices="[0, 4, 5, 1, 2, 3, 7, 6, 0, 1, 3, 2, 0, 2, 6, 4, 1, 5, 7, 3, 4, 6, 7, 5]",
)
CAMERA_INSIDE = harness.CAMERA.replace("(0, 0, 4)", "(0.3, 0.2, 1.5)")


@pytest.mark.parametrize("nee", [1, 0])
def test_closed_furnace(render, tmp_path, nee):
    """Everything emits 1 and reflects 0.8: radiance 1 / (1 - 0.8) everywhere, exactly."""
    stage = harness.write_stage(tmp_path / "furnace.usda", CAMERA_INSIDE, harness.mesh(**INSIDE_OUT_CUBE),
                                harness.matte(0.8, 1.0))
    images = render.seeds(stage, *PATHTRACE, "--spp", 512, "--set", f"pathtrace.nee={nee}", count=4)
    assert images.mean() == pytest.approx(5, rel=0.005)
    # No part of the room is brighter than another.
    t, degrees = metrics.block_t(images, np.full(images.shape[1:], 5.0), 3)
    assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size > 1e-6


CONVEX = {
    "sphere": """
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 3.2
        rel material:binding = </World/Matte>
    }
""",
    "cube": harness.mesh(
        points=str([(x, y, z) for z in (-2, 2) for y in (-2, 2) for x in (-4, 4)]),
        counts="[4, 4, 4, 4, 4, 4]",
        indices="[0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6, 0, 4, 6, 2, 1, 3, 7, 5]",
        extra='float xformOp:rotateX = 45\n        uniform token[] xformOpOrder = ["xformOp:rotateX"]'),
}


@pytest.mark.parametrize("technique", ["pathtrace", "raytrace"])
@pytest.mark.parametrize("shape", CONVEX)
def test_convex_object_in_a_white_dome(render, tmp_path, shape, technique):
    """A convex Lambert object sees the dome only: radiance is its albedo, wherever it is seen. It fills the picture."""
    dome = '    def DomeLight "Dome"\n    {\n        float inputs:intensity = 1\n    }\n'
    stage = harness.write_stage(tmp_path / "dome.usda", harness.CAMERA, CONVEX[shape], harness.matte(0.8), dome)
    image = render(stage, "-t", technique, "--spp", 1024).image
    # One uniform direction of the sphere has a standard deviation near 1: 0.0013 over this many, and five of those.
    assert image.mean() == pytest.approx(0.8, rel=0.002 if technique == "pathtrace" else 0.0085)
    assert metrics.block_means(image, 3) == pytest.approx(0.8, rel=0.05)


def test_light_behind_its_back_is_dark(render, tmp_path):
    """A RectLight shines along -Z only: seen from +Z it is black, and it lights nothing there."""
    light = '    def RectLight "Lamp"\n    {\n        float inputs:width = 20\n        float inputs:height = 20\n' \
            '        float inputs:intensity = 1.25\n    }\n'
    behind = harness.write_stage(tmp_path / "behind.usda", harness.CAMERA, light)
    before = harness.write_stage(tmp_path / "before.usda", harness.CAMERA, light.replace(
        "intensity = 1.25\n", "intensity = 1.25\n        float xformOp:rotateY = 180\n"
        '        uniform token[] xformOpOrder = ["xformOp:rotateY"]\n'))
    assert (render(behind, *PATHTRACE).image == 0).all()
    assert render(before, *PATHTRACE).image == pytest.approx(1.25, rel=1e-5)


# ---- estimators agree with each other ----------------------------------------------------------

def test_without_next_event_estimation(render):
    """pathtrace.nee=0 finds lamps by chance only, and the same picture."""
    images = render.seeds("cornell_big_light", *PATHTRACE, "--spp", 512, "--set", "pathtrace.nee=0", count=4)
    reference = harness.reference("cornell_big_light")
    ratios = [metrics.mean_ratio(i, reference.image, ~reference.lamp) for i in images]
    mean, error = metrics.confidence(ratios)
    assert error < 0.005
    # Four seeds: three degrees of freedom; one in a thousand.
    assert metrics.student_tail(abs(mean - 1) / np.hypot(error, reference.mean_error), 3) * 2 > 1e-3, ratios
    t, degrees = metrics.block_t(images, reference.image, 3, ~reference.lamp)
    assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size > 1e-6


@pytest.mark.parametrize("technique", ["pathtrace", "raytrace"])
def test_five_boxes_are_as_bright_as_one(render, technique):
    """The darkening test: four more lamps out of sight change nothing. With the AOVs these are the image suites' renders."""
    aovs = harness.CLASSES if technique == "pathtrace" else ()
    one, five = (render.seeds(stage, "-t", technique, "--spp", 2048, count=2, aovs=aovs) for stage in ("one_box", "five_boxes"))
    assert metrics.mean_ratio(five.mean(axis=0), one.mean(axis=0)) == pytest.approx(1, abs=0.005)


def test_uncompensated_light_selection_darkens_as_in_the_paper(render):
    """One lamp in five chosen, and no division by that: a fifth of the light is left."""
    flags = (*RAYTRACE, "--spp", 1024)
    one = render("one_box", *flags, "--set", "light.selection=uncompensated").image
    five = render("five_boxes", *flags, "--set", "light.selection=uncompensated").image
    lamp = harness.reference("one_box").lamp
    assert metrics.mean_ratio(five, one, ~lamp) == pytest.approx(0.2, rel=0.03)


# ---- invariances -------------------------------------------------------------------------------

def test_tracers_agree(render):
    """Both tracers find the same hits to within rounding. A ray in 10,000 may pass an edge on the other side; at 5
    rays to a path and 16 paths that touches less than one pixel in a hundred."""
    flags = (*PATHTRACE, "--spp", 16, "--seed", 3)
    for stage in ("cornell_glass", "white_room", "maze"):
        compute = render(stage, *flags, "--tracer", "compute")
        query = render(stage, *flags, "--tracer", "query")
        assert (compute.stats["tracer"], query.stats["tracer"]) == ("compute", "query")
        close = np.isclose(compute.image, query.image, rtol=1e-3, atol=1e-5).all(axis=2)
        assert close.mean() > 0.98, stage


@pytest.mark.parametrize("tracer", ["compute", "query"])
@pytest.mark.parametrize("stage", ["cornell_glass", "maze"])
def test_same_seed_same_image_on_any_number_of_threads(render, stage, tracer):
    """Bit for bit. LP_NUM_THREADS is lavapipe's number of threads; on a GPU this repeats the run."""
    flags = (*PATHTRACE, "--spp", 4, "--seed", 7, "--tracer", tracer)
    one = render(stage, *flags, env={"LP_NUM_THREADS": "1"}, size=(96, 54)).image
    two = render(stage, *flags, env={"LP_NUM_THREADS": "2"}, size=(96, 54)).image
    assert (one == two).all()


def test_seeds_are_independent(render):
    """Neighbouring seeds share nothing: their residuals do not correlate (5 standard errors)."""
    a, b = (render("cornell_light_sphere", *PATHTRACE, "--spp", 16, "--seed", seed).image[..., 1] for seed in (0, 1))
    expected = harness.reference("cornell_light_sphere").image[..., 1]
    assert not np.array_equal(a, b)
    relative = [((i - expected) / (expected + 0.1)).ravel() for i in (a, b)]
    assert abs(np.corrcoef(relative)[0, 1]) < 5 / np.sqrt(a.size)


@pytest.mark.parametrize("by", ["unit", "transform"])
@pytest.mark.parametrize("factor", [1e-3, 1e3])
@pytest.mark.parametrize("name", ["cornell_light_sphere", "cornell_glass"])
def test_scaled_stage_gives_the_same_image(render, tmp_path, name, factor, by):
    """A factor that is no power of two rounds differently; a path in a few thousand then goes another way."""
    flags = (*PATHTRACE, "--spp", 16, "--seed", 5)
    image = render(harness.scaled_stage(name, tmp_path / "scaled.usda", factor, by), *flags).image
    expected = render(name, *flags).image
    assert np.isclose(image, expected, rtol=1e-3, atol=1e-5).all(axis=2).mean() > 0.97
    assert np.median(np.abs(image / np.maximum(expected, 1e-9) - 1)) < 1e-4


@pytest.mark.parametrize("factor", [1e-5, 1e5])
@pytest.mark.parametrize("name", ["cornell_light_sphere", "white_room"])
def test_scaled_emission_scales_the_image(render, tmp_path, name, factor):
    path = harness.scaled_emission(name, tmp_path / "scaled.usda", factor)
    flags = (*PATHTRACE, "--spp", 16, "--seed", 5)
    assert render(path, *flags).image / factor == pytest.approx(render(name, *flags).image, rel=1e-3)


@pytest.mark.parametrize("name", ["cornell_light_sphere"])
def test_up_axis_z_is_turned(render, tmp_path, name):
    """The same world written with Z up: the same image."""
    stage = Usd.Stage.Open(str(harness.find_stage(name)))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.Xformable(stage.GetPrimAtPath("/World")).AddRotateXOp().Set(90.0)
    path = tmp_path / "z_up.usda"
    stage.GetRootLayer().Export(str(path))
    flags = (*PATHTRACE, "--spp", 16, "--seed", 5)
    close = np.isclose(render(path, *flags).image, render(name, *flags).image, rtol=1e-3, atol=1e-5).all(axis=2)
    assert close.mean() > 0.97


def test_frames_of_an_average_add_up(render):
    """--spp 8 is the mean of 8 independent frames: an eighth of the variance at most, less by stratification."""
    few = render.seeds("cornell_empty", *PATHTRACE, "--spp", 1, count=5)
    many = render.seeds("cornell_empty", *PATHTRACE, "--spp", 8, count=5)
    gain = few.var(axis=0, ddof=1).mean() / many.var(axis=0, ddof=1).mean()
    assert gain > 8 * 0.8, gain


def test_aovs_add_up_to_the_image(render):
    """Each path class in its own picture; together they are the picture."""
    result = render("cornell_glass", *PATHTRACE, "--spp", 16, aovs=("emission", *harness.CLASSES))
    assert sum(result.aovs.values()) == pytest.approx(result.image, rel=1e-4, abs=1e-5)
    assert all(p.mean() > 0 for p in result.aovs.values())


def test_statistics_name_the_run(render):
    stats = render("cornell_empty", *PATHTRACE, "--spp", 4).stats
    assert {"version", "device", "tracer", "technique", "stage", "width", "height", "startup_ms", "frames"} <= stats.keys()
    assert {"name", "driver", "type"} <= stats["device"].keys()
    assert {"device", "load", "pipelines", "first_frame"} <= stats["startup_ms"].keys()
    assert (stats["technique"], stats["width"], stats["height"]) == ("pathtrace", *harness.SIZE)
    frame, = stats["frames"]
    assert {"frame", "spp", "ms", "nodes", "rays", "accel", "nonfinite", "memory_bytes"} <= frame.keys()
    assert {"blas_built", "blas_refit", "tlas_built"} <= frame["accel"].keys()
    assert frame["spp"] == 4 and frame["nonfinite"] == 0
    # One camera ray for each pixel and sample at least, and no more than 4096 for each.
    pixels = harness.SIZE[0] * harness.SIZE[1] * 4
    assert pixels <= frame["rays"] < 4096 * pixels
    states = {n["name"]: n["state"] for n in frame["nodes"]}
    assert states["pathtrace"] == "run" and set(states.values()) <= {"run", "skipped", "idle"}
