"""ReSTIR DI through the command: agreement with Mitsuba, bad scenes, scaling, cost. Moving scenes: restir_di_test.cpp."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

import bpt_stages
import harness
from harness import CLASSES
from trilume_bench import metrics, stages

RESTIR = ("-t", "restir")
REUSE = (*RESTIR, "--set", "restir_di.reuse=spatiotemporal")


def mean_ratios(images, reference):
    return [metrics.mean_ratio(i, reference.image, ~reference.lamp) for i in images]


@pytest.mark.parametrize("stage", ["one_box", "cornell_light_sphere", "maze"])
def test_direct_light_agrees_with_the_reference(render, stage):
    """Seeds are independent, pixels are not: Student's t over seeds, of the mean and of each block of 6 x 6 pixels."""
    count, block = 8, 6
    images = render.seeds(stage, *REUSE, "--spp", 256, count=count)
    reference = harness.reference(f"{stage}.direct")
    mean, error = metrics.confidence(mean_ratios(images, reference))
    assert error < 0.005
    assert metrics.student_tail(abs(mean - 1) / np.hypot(error, reference.mean_error), count - 1) * 2 > 1e-3
    # The reference's own error counts as much in a block as its relMSE says for the picture.
    found = np.stack([metrics.block_means(i, block).mean(axis=-1) for i in images])
    expected = metrics.block_means(reference.image, block).mean(axis=-1)
    own = np.sqrt(reference.relmse * (expected**2 + metrics.RELMSE_EPSILON)) / block
    errors = np.hypot(found.std(axis=0, ddof=1) / np.sqrt(count), own)
    lamps = metrics.block_means(reference.lamp[..., None], block)[..., 0] > 0
    t = np.abs(found.mean(axis=0) - expected)[~lamps] / errors[~lamps]
    assert metrics.student_tail(t.max(), count - 1) * 2 * t.size > 1e-3


LAMPS = {
    "objects": lambda folder: bpt_stages.objects(folder / "objects.usda"),
    "sky": lambda folder: bpt_stages.sky(folder / "sky.usda", folder / "spots.exr"),
}


@pytest.mark.parametrize("technique, spp, signals", [(REUSE, 128, ("direct",)), (("-t", "restir_bpt"), 32, CLASSES)],
                         ids=["restir", "restir_bpt"])
@pytest.mark.parametrize("name", LAMPS)
def test_reuse_among_lamps_of_every_kind(render, tmp_path, name, technique, spp, signals):
    """Spheres, disks, tubes, panels, suns, a textured dome, a textured and a cut-out mesh; mirrors and glass, a thin lens: path
    tracing's light in each path class.

    Frames of a run share reservoirs, so that seeds alone are independent: Student's t over them, of the mean and of blocks.
    """
    stage, count, block = LAMPS[name](tmp_path), 8, 6
    ours = render.runs(stage, *technique, "--spp", spp, count=count, aovs=signals)
    theirs = render.runs(stage, "-t", "pathtrace", "--spp", 384, count=count, first=11, aovs=CLASSES)
    for signal in signals:
        found, expected = (np.stack([r.aovs[signal] for r in runs]).astype(np.float64) for runs in (ours, theirs))

        def chance(kind):
            means, others = (kind(x).reshape(count, -1) for x in (found, expected))
            errors = np.hypot(*(x.std(axis=0, ddof=1) for x in (means, others))) / np.sqrt(count)
            t = np.abs(means.mean(axis=0) - others.mean(axis=0)) / np.maximum(errors, 1e-12)
            return metrics.student_tail(t.max(), count - 1) * 2 * t.size

        assert chance(lambda x: x.mean(axis=(1, 2, 3))) > 1e-3, (signal, found.mean(), expected.mean())
        # Path tracing finds caustics too rarely for the spread of a block to tell.
        assert signal == "caustic" or chance(lambda x: np.stack([metrics.block_means(i, block) for i in x])) > 1e-3, signal


def test_five_boxes_are_as_bright_as_one(render):
    """The darkening test, with reuse among all five lamps."""
    one = render.seeds("one_box", *REUSE, "--spp", 512, count=2)
    five = render.seeds("five_boxes", *REUSE, "--spp", 512, count=2)
    assert metrics.mean_ratio(five.mean(axis=0), one.mean(axis=0)) == pytest.approx(1, abs=0.005)


def test_a_single_light_costs_what_ray_tracing_costs(render):
    """No reuse, and it says so: the same rays, the same random numbers, the same picture."""
    flags = ("--spp", 16, "--seed", 3)
    restir, raytrace = render("one_box", *RESTIR, *flags), render("one_box", "-t", "raytrace", *flags)
    node, = (n for n in restir.stats["frames"][0]["nodes"] if n["name"] == "restir_di")
    assert "no reuse" in node["reason"]
    assert restir.stats["frames"][0]["rays"] == raytrace.stats["frames"][0]["rays"]
    assert restir.image == pytest.approx(raytrace.image, rel=1e-4, abs=1e-6)


def test_bsdf_samples_where_nothing_is_rough(render):
    """Candidates of the BSDF on Lambert surfaces too: their weights and the light samples' go together."""
    runs = [render.runs("cornell_empty", "-t", "restir", "--spp", 64, "--set", f"restir_di.bsdfRoughness={r}", count=4,
                        aovs=("direct",)) for r in (0.5, 1)]
    few, all_ = ([run.aovs["direct"].mean() for run in r] for r in runs)
    assert np.mean(all_) == pytest.approx(np.mean(few), rel=5e-3)


def test_a_strong_lamp_out_of_sight_hides_nothing(render, tmp_path):
    """It wins every resampling that knows nothing of shadows, and brings nothing; tiles learn that."""
    bright = tmp_path / "bright.usda"
    stages.edited(harness.CONTENT / "five_boxes.usda", bright, stages.emission(1e8, "/World/Box1"))
    flags = (*RESTIR, "--spp", 256, "--warmup", 8)
    image, expected = render(bright, *flags).image, render("five_boxes", *flags).image
    assert image.mean() == pytest.approx(expected.mean(), rel=0.01)
    assert np.median(image) == pytest.approx(np.median(expected), rel=0.02)


def test_learning_the_lights_pays(render):
    """With a quarter of the candidates there is less error than with the light of all 20 lamps and no word of shadows."""
    reference = harness.reference("maze.direct")
    errors = {warmup: np.mean([metrics.relmse(i, reference.image) for i in
                               render.seeds("maze", *RESTIR, "--spp", 1, "--warmup", warmup, count=12)])
              for warmup in (0, 8)}
    assert errors[8] < 0.85 * errors[0]


@pytest.mark.skipif(not harness.FULL, reason="times need a quiet machine; set TRILUME_FULL=1")
def test_a_thousand_lamps_at_equal_time(render, tmp_path):
    """At most a fifth of the error of ray tracing that takes as long, of the light that lamps throw: their edges are others'."""
    stage = tmp_path / "hall.usda"
    stages.hall(stage, lamps=1000)
    direct = {"aovs": ("direct",)}
    reference = render(stage, "-t", "raytrace", "--spp", 12288, "--seed", 7, **direct).aovs["direct"]
    restir = render(stage, *RESTIR, "--spp", 64, **direct)
    per_frame = render(stage, "-t", "raytrace", "--spp", 256).stats["frames"][0]["ms"] / 256
    count = round(restir.stats["frames"][0]["ms"] / per_frame)
    raytrace = render(stage, "-t", "raytrace", "--spp", count, **direct)
    assert metrics.mse(restir.aovs["direct"], reference) <= metrics.mse(raytrace.aovs["direct"], reference) / 5


@pytest.mark.parametrize("tracer", ["compute", "query"])
def test_same_seed_same_image_on_any_number_of_threads(render, tracer):
    flags = (*REUSE, "--spp", 4, "--tracer", tracer)
    one = render("maze", *flags, env={"LP_NUM_THREADS": "1"}, size=(96, 54)).image
    two = render("maze", *flags, env={"LP_NUM_THREADS": "2"}, size=(96, 54)).image
    assert (one == two).all()


@pytest.mark.parametrize("factor", [1e-5, 1e5])
def test_scaled_emission_scales_the_image(render, tmp_path, factor):
    path = harness.scaled_emission("maze", tmp_path / "scaled.usda", factor)
    flags = (*REUSE, "--spp", 8, "--seed", 5)
    image, expected = render(path, *flags).image / factor, render("maze", *flags).image
    # What is chosen in a merge turns on rounding: a choice in a few thousand, and what is drawn from it, goes otherwise.
    assert np.isclose(image, expected, rtol=1e-3).all(axis=2).mean() > 0.9
    assert image.mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_scaled_stage_gives_the_same_image(render, tmp_path, factor):
    path = harness.scaled_stage("maze", tmp_path / "scaled.usda", factor)
    flags = (*REUSE, "--spp", 64, "--seed", 5)
    assert render(path, *flags).image.mean() == pytest.approx(render("maze", *flags).image.mean(), rel=0.02)


# ---- bad scenes --------------------------------------------------------------------------------

def triangles(path, count):
    """`count` small glowing triangles around a floor."""
    rng = np.random.default_rng(1)
    stage = Usd.Stage.Open(str(harness.write_stage(path, harness.CAMERA, harness.matte(), harness.mesh(),
                                                   harness.matte(0, 5, "Glow"))))
    mesh = UsdGeom.Mesh.Define(stage, "/World/Triangles")
    centers = rng.uniform((-2, -1, 0.1), (2, 1, 1), (count, 1, 3))
    points = (centers + rng.uniform(-0.02, 0.02, (count, 3, 3))).reshape(-1, 3).astype(np.float32)
    mesh.GetPointsAttr().Set(points)
    mesh.GetFaceVertexCountsAttr().Set([3] * count)
    mesh.GetFaceVertexIndicesAttr().Set(list(range(3 * count)))
    mesh.GetSubdivisionSchemeAttr().Set("none")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(UsdShade.Material.Get(stage, "/World/Glow"))
    target = path.with_suffix(".usdc")
    stage.GetRootLayer().Export(str(target))
    return target


def nonfinite(run):
    return sum(f["nonfinite"] for f in run.stats["frames"])


@pytest.mark.parametrize("parts", [
    (harness.matte(), harness.mesh()),
    (harness.matte(0), harness.mesh(), harness.LAMP),
    (harness.matte(), harness.mesh("[(-1, -1, 0), (1, -1, 0), (1, 1, 0)]", "[3]", "[0, 1, 2]"), harness.LAMP),
    (harness.matte(), harness.mesh("[(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)]"), harness.LAMP),
], ids=["no lights", "zero albedo", "one triangle", "camera in a wall"])
def test_bad_scenes(render, tmp_path, parts):
    stage = harness.write_stage(tmp_path / "bad.usda", harness.CAMERA, *parts)
    run = render(stage, *REUSE, "--spp", 4, "--default-light", "off")
    assert nonfinite(run) == 0


@pytest.mark.parametrize("count", [1, 100_000])
def test_glowing_triangles(render, tmp_path, count):
    """The sum over 100,000 lights, of which a pixel sees a few dozen well; ray tracing is the reference."""
    stage = triangles(tmp_path / "triangles.usda", count)
    run = render(stage, *REUSE, "--spp", 64)
    assert nonfinite(run) == 0
    expected = render(stage, "-t", "raytrace", "--spp", 1024).image
    # One triangle may face away from everything: black, but for what it shows of itself.
    assert run.image.mean() == pytest.approx(expected.mean(), rel=0.02, abs=1e-4)
