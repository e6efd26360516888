"""Bidirectional path tracing: agreement with path tracing class by class, exact solutions, invariances.

Agreement with Mitsuba: tests/image. Scenes that leave nothing to do: tests/playback.
"""

import numpy as np
import pytest

import bpt_stages
import harness
from trilume_bench import metrics
from harness import CLASSES
from test_pathtrace import CAMERA_INSIDE, INSIDE_OUT_CUBE

BPT = ("-t", "bpt")


# ---- agreement with path tracing ---------------------------------------------------------------

STAGES = {
    "objects": lambda folder: bpt_stages.objects(folder / "objects.usda"),
    "sky": lambda folder: bpt_stages.sky(folder / "sky.usda", folder / "spots.exr"),
    "inside_glass": lambda folder: bpt_stages.inside_glass(folder / "inside_glass.usda"),
}


@pytest.mark.parametrize("name", STAGES)
def test_agrees_with_path_tracing_class_by_class(render, tmp_path, name):
    """Lamps of every kind, textured and cut-out emitters, mirrors, plastics, rough and smooth glass, smooth normals on few
    faces, a thin lens, a camera inside glass: the same light in each path class.

    Pixels of both pictures are independent, so the spread of their differences tells how far the mean and the means of
    blocks may differ. Path tracing finds caustics too rarely for a block's spread to tell: there the mean alone is judged.
    """
    stage = STAGES[name](tmp_path)
    ours = render(stage, *BPT, "--spp", 96, "--seed", 1, aovs=CLASSES).aovs
    theirs = render(stage, "-t", "pathtrace", "--spp", 768, "--seed", 2, aovs=CLASSES).aovs
    for signal in CLASSES:
        difference = ours[signal].astype(np.float64) - theirs[signal]
        error = difference.std() / np.sqrt(difference.size)
        assert abs(difference.mean()) < 4.5 * error, (signal, ours[signal].mean(), theirs[signal].mean(), error)
        t, degrees = metrics.block_t(difference[None], np.zeros_like(difference), 3)
        chance = metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size
        assert signal == "caustic" or chance > 1e-6, (signal, np.abs(t).max())


@pytest.mark.parametrize("options", [("bpt.maxLightVertices=1",), ("bpt.heuristic=balance",),
                                     ("bpt.rouletteDepth=0",)])
def test_how_paths_are_weighed_changes_the_noise_only(render, options):
    """Random subsets of light vertices, another heuristic, early roulette: the same picture."""
    reference = harness.reference("cornell_light_sphere")
    flags = [x for option in options for x in ("--set", option)]
    image = render("cornell_light_sphere", *BPT, "--spp", 64, *flags).image[None]
    t, degrees = metrics.block_t(image, reference.image, 3, ~reference.lamp)
    assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size > 1e-6
    assert metrics.mean_ratio(image[0], reference.image, ~reference.lamp) == pytest.approx(1, abs=0.01)


def test_caustics_of_a_sun_of_one_direction(render, tmp_path):
    """Light of one direction through glass, which no eye subpath finds, is that of a narrow sun of the same irradiance."""
    sharp, narrow = (render(bpt_stages.sun_on_glass(tmp_path / f"sun{angle}.usda", angle), *BPT, "--spp", 64,
                            aovs=["caustic"]).aovs["caustic"].mean() for angle in (0.0, 0.5))
    assert sharp > 0 and sharp == pytest.approx(narrow, rel=0.03)


# ---- exact solutions ---------------------------------------------------------------------------

def test_closed_furnace(render, tmp_path):
    """Everything emits 1 and reflects 0.8: 1 seen, 0.8 direct, 0.8^2 / (1 - 0.8) indirect."""
    stage = harness.write_stage(tmp_path / "furnace.usda", CAMERA_INSIDE, harness.mesh(**INSIDE_OUT_CUBE),
                                harness.matte(0.8, 1.0))
    run = render(stage, *BPT, "--spp", 128, aovs=CLASSES)
    for signal, expected in {"image": 5.0, "direct": 0.8, "indirect": 3.2}.items():
        image = run.aovs.get(signal, run.image)
        assert image.mean() == pytest.approx(expected, rel=0.005), signal
        t, degrees = metrics.block_t(image[None], np.full_like(image, expected), 3)
        assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size > 1e-6, signal


# ---- light selection ---------------------------------------------------------------------------

def test_five_boxes_are_as_bright_as_one(render):
    one = render("one_box", *BPT, "--spp", 256).image
    five = render("five_boxes", *BPT, "--spp", 256).image
    assert metrics.mean_ratio(five, one) == pytest.approx(1, abs=0.005)


def test_uncompensated_light_selection_darkens_as_in_the_paper(render):
    """One lamp in five, and no division by that. What eye subpaths find of the lamp by themselves stays."""
    flags = (*BPT, "--spp", 64, "--set", "light.selection=uncompensated")
    lamp = harness.reference("one_box").lamp
    ratio = metrics.mean_ratio(render("five_boxes", *flags).image, render("one_box", *flags).image, ~lamp)
    assert 0.19 < ratio < 0.26


def test_starts_from_reservoirs_keep_the_light_that_a_pixel_does_not_see(render):
    """restir_bpt is as bright as the truth in five boxes; without a share of starts by power, as in the paper, it is not.

    Reservoirs tie the frames of a run and neighbouring pixels together: only the seeds are independent.
    """
    reference = harness.reference("one_box")

    def ratio(seed, *options):
        image = render("five_boxes", "-t", "restir_bpt", "--spp", 32, "--seed", seed, *options).image
        return metrics.mean_ratio(image, reference.image, ~reference.lamp)

    mean, error = metrics.confidence([ratio(seed) for seed in range(4)])
    assert metrics.student_tail(abs(mean - 1) / error, 3) * 2 > 1e-3 and error < 0.01
    assert ratio(1, "--set", "bpt.powerShare=0") < 0.95


# ---- invariances -------------------------------------------------------------------------------

def test_same_seed_same_image_on_any_number_of_threads(render):
    """Bit for bit, though splats of all threads meet in one pixel."""
    flags = (*BPT, "--spp", 4, "--seed", 7)
    one = render("cornell_glass", *flags, env={"LP_NUM_THREADS": "1"}, size=(48, 27)).image
    two = render("cornell_glass", *flags, env={"LP_NUM_THREADS": "2"}, size=(48, 27)).image
    assert (one == two).all()


@pytest.mark.parametrize("factor", [1e-3, 1e3] if harness.FULL else [1e-3])
def test_scaled_stage_gives_the_same_image(render, tmp_path, factor):
    """A factor that is no power of two rounds differently; a path in a few thousand then goes another way."""
    flags = (*BPT, "--spp", 16, "--seed", 5)
    image = render(harness.scaled_stage("cornell_glass", tmp_path / "scaled.usda", factor, "transform"), *flags).image
    expected = render("cornell_glass", *flags).image
    assert np.isclose(image, expected, rtol=1e-3, atol=1e-5).all(axis=2).mean() > 0.9
    assert np.median(np.abs(image / np.maximum(expected, 1e-9) - 1)) < 1e-4


@pytest.mark.parametrize("factor", [1e-5, 1e5])
def test_scaled_emission_scales_the_image(render, tmp_path, factor):
    path = harness.scaled_emission("cornell_glass", tmp_path / "scaled.usda", factor)
    flags = (*BPT, "--spp", 16, "--seed", 5)
    assert render(path, *flags).image / factor == pytest.approx(render("cornell_glass", *flags).image, rel=1e-3)


# ---- choice and cost ---------------------------------------------------------------------------

@pytest.mark.parametrize("stage,node", [("cornell_empty", "pathtrace"), ("cornell_glass", "bpt")])
def test_reference_takes_the_better_one(render, stage, node):
    nodes = {n["name"]: n for n in render(stage, "-t", "reference").stats["frames"][0]["nodes"]}
    other, = {"pathtrace", "bpt"} - {node}
    assert nodes[node]["state"] == "run" and nodes[other]["state"] == "skipped"
    assert "casters" in nodes[other]["reason"]


@pytest.mark.skipif(not harness.FULL, reason="takes minutes")
def test_a_quarter_of_the_error_of_path_tracing_in_the_same_time(render):
    """cornell_glass: error times time, in turns."""
    reference = harness.reference("cornell_glass")
    costs = {"bpt": [], "pathtrace": []}
    for seed in range(3):
        for technique, spp in (("bpt", 64), ("pathtrace", 256)):
            run = render("cornell_glass", "-t", technique, "--spp", spp, "--seed", seed)
            costs[technique].append(metrics.relmse(run.image, reference.image) * run.stats["frames"][0]["ms"])
    assert np.mean(costs["bpt"]) < 0.25 * np.mean(costs["pathtrace"]), costs
