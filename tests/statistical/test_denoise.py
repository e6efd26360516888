"""The denoisers: what they keep, what they gain, and that they let go of what has changed."""

import numpy as np
import pytest

import harness
from trilume_bench import metrics

SIZE = (64, 36)
TEMPORAL = ("--denoise", "temporal")


def without_emission(run):
    """The picture without the emission seen directly, which is averaged over frames but not filtered."""
    return run.image - run.aovs["emission"]


def scattered(render, stage, *options):
    return without_emission(render(stage, *options, size=SIZE, aovs=("emission",)))


@pytest.mark.parametrize("stage, technique", [("cornell_empty", "pathtrace"), ("maze", "raytrace")])
def test_light_is_kept_and_noise_is_not(render, stage, technique):
    """The last of 17 frames of a still scene holds the light of all 17, in a better picture than their average.

    Radiance is exchanged between pixels and none is lost, so the sums agree to rounding. Their average alone has a 17th of
    a frame's error; on surfaces that are smooth over a few pixels the filter at least halves what is left.
    """
    truth = scattered(render, stage, "-t", technique, "--spp", 1024, "--seed", 7)
    frame = scattered(render, stage, "-t", technique, "--warmup", 16, "--denoise", "off")
    average = scattered(render, stage, "-t", technique, "--spp", 17)
    denoised = scattered(render, stage, "-t", technique, "--warmup", 16, *TEMPORAL)
    assert denoised.mean() == pytest.approx(average.mean(), rel=1e-4)
    assert metrics.relmse(denoised, truth) < metrics.relmse(average, truth) / 2
    assert metrics.relmse(denoised, truth) < metrics.relmse(frame, truth) / 34


def test_filter_narrows_as_history_grows(render):
    """Nothing but noise is filtered: error falls with the number of frames, where a fixed blur's would stay."""
    truth = scattered(render, "cornell_light_sphere", "-t", "raytrace", "--spp", 1024, "--seed", 7)
    errors = [metrics.relmse(scattered(render, "cornell_light_sphere", "-t", "raytrace", "--warmup", n - 1, *TEMPORAL,
                                       "--set", "denoise.maxFrames=1024"), truth) for n in (4, 32, 256)]
    assert errors[1] < errors[0] / 3 and errors[2] < errors[1] / 3, errors


def test_average_of_denoised_frames(render):
    """--spp N with a denoiser asked for: the mean of N frames is that of the raw ones but for the filter's memory, by
    which early frames count more than late ones: within the noise of a few frames, 1% here."""
    raw = scattered(render, "cornell_empty", "-t", "pathtrace", "--spp", 64)
    denoised = scattered(render, "cornell_empty", "-t", "pathtrace", "--spp", 64, *TEMPORAL)
    assert denoised.mean() == pytest.approx(raw.mean(), rel=0.01)


def play(folder, stage, frames, *options):
    done = harness.run("render", "--imageWidth", SIZE[0], "--imageHeight", SIZE[1], "-t", "raytrace", "-f", f"1:{frames}",
                       *options, "--aov", f"emission={folder}/emission.####.pfm", harness.find_stage(stage),
                       folder / "image.####.pfm")
    assert done.status == 0, done.stderr
    return np.stack([metrics.read_image(folder / f"image.{f:04d}.pfm") - metrics.read_image(folder / f"emission.{f:04d}.pfm")
                     for f in range(1, frames + 1)])


def test_moving_lamp_ring_and_camera(command, tmp_path):
    """Every frame is nearer to its own reference than a raw one is, though history is of other frames."""
    truth = play(tmp_path, "animated", 12, "--spp", 256)
    raw = play(tmp_path, "animated", 12, "--denoise", "off")
    denoised = play(tmp_path, "animated", 12)
    errors = [[metrics.relmse(a, b) for a, b in zip(frames, truth)] for frames in (raw, denoised)]
    assert all(d < r for r, d in zip(*errors)), errors
    assert np.mean(errors[1][1:]) < 0.5 * np.mean(errors[0][1:]), errors


def bulb(name, place, intensity, radius):
    return f"""
    def SphereLight "{name}"
    {{
        float inputs:radius = {radius}
        float inputs:intensity{intensity}
        double3 xformOp:translate = {place}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""


SWITCHED = bulb("Switched", (-1, 2, 3), ".timeSamples = { 1: 20, 8: 20, 9: 0 }", 0.3)


def test_light_switched_off(command, tmp_path):
    """Eight frames with it, then four without: nine tenths of its light are gone at once, the rest soon."""
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, harness.LAMP, SWITCHED, harness.matte(),
                                harness.mesh())
    truth = play(tmp_path, stage, 12, "--spp", 64)
    denoised = play(tmp_path, stage, 12, *TEMPORAL)
    assert truth[8].mean() < 0.5 * truth[7].mean()
    ghost = (denoised[8:].mean(axis=(1, 2, 3)) - truth[8:].mean(axis=(1, 2, 3))) / (truth[7].mean() - truth[8].mean())
    assert (np.abs(ghost) < [0.1, 0.06, 0.05, 0.05]).all(), ghost


# ---- emission ----------------------------------------------------------------------------------

WINDOW = """
    def RectLight "Window"
    {
        float inputs:width = 1.4
        float inputs:height = 1
        float inputs:intensity.timeSamples = { 1: 4, 20: 4, 21: 0 }
        double3 xformOp:translate = (0, 0, -0.5)
        double xformOp:rotateY = 180
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
    }
"""
BEHIND_CAMERA = bulb("Reflected", (-1, 1.2, 6), ".timeSamples = { 1: 20, 20: 20, 21: 0 }", 0.5)
PANE = harness.mesh("[(-1.1, -0.8, 1), (1.1, -0.8, 1), (1.1, 0.8, 1), (-1.1, 0.8, 1), (-1.1, -0.8, 1.05), (1.1, -0.8, 1.05), "
                    "(1.1, 0.8, 1.05), (-1.1, 0.8, 1.05)]", "[4, 4, 4, 4, 4, 4]",
                    "[3, 2, 1, 0, 4, 5, 6, 7, 0, 1, 5, 4, 2, 3, 7, 6, 1, 2, 6, 5, 3, 0, 4, 7]", name="Pane", material="Glass")
WALL = harness.mesh("[(-4, -3, -1), (4, -3, -1), (4, 3, -1), (-4, 3, -1)]", name="Wall")
MOVER = harness.mesh("[(-0.2, -0.2, 0), (0.2, -0.2, 0), (0.2, 0.2, 0), (-0.2, 0.2, 0)]", name="Mover", extra="""
        double3 xformOp:translate.timeSamples = { 1: (-2, 0, -0.2), 21: (2, 0, -0.2) }
        uniform token[] xformOpOrder = ["xformOp:translate"]""")
MOVING_CAMERA = harness.CAMERA.replace("xformOp:translate = (0, 0, 4)",
                                       "xformOp:translate.timeSamples = { 1: (0, 0, 4), 21: (0.4, 0.1, 3.6) }")


def pane(folder, *parts, camera=harness.CAMERA):
    """A window and a wall behind a pane of glass, in which a lamp is reflected; other paths by the glass find nothing."""
    return harness.write_stage(folder / "stage.usda", camera, WINDOW, BEHIND_CAMERA, harness.matte(0.6), harness.GLASS, PANE, WALL,
                               *parts)


def play_emission(folder, stage, frames, *options):
    done = harness.run("render", "--imageWidth", SIZE[0], "--imageHeight", SIZE[1], "-t", "raytrace", "-f", f"1:{frames}",
                       *options, "--aov", f"emission={folder}/emission.####.pfm", stage, folder / "image.####.pfm")
    assert done.status == 0, done.stderr
    return np.stack([metrics.read_image(folder / f"emission.{f:04d}.pfm") for f in range(1, frames + 1)])


def test_emission_is_the_mean_of_its_frames(render, tmp_path):
    """Lamps' outlines, and a window that one pixel in six misses by reflection: no filter, and all 17 frames count alike."""
    for stage in ("cornell_light_sphere", pane(tmp_path)):
        average, denoised = (render(stage, "-t", "raytrace", *options, size=SIZE, aovs=("emission",)).aovs["emission"]
                             for options in (("--spp", 17), ("--warmup", 16, *TEMPORAL)))
        assert np.allclose(denoised, average, rtol=1e-4, atol=1e-5)


def test_emission_while_something_else_moves(command, tmp_path):
    """A tenth of the error of frames, where the mover is not, and no bias beyond the test's 1% and noise."""
    stage = pane(tmp_path, MOVER)
    truth = play_emission(tmp_path, stage, 20, "--spp", 256)[12:]
    raw = play_emission(tmp_path, stage, 20, "--denoise", "off")[12:]
    denoised = play_emission(tmp_path, stage, 20)[12:]
    far = np.abs(truth - truth[:1]).max(axis=(0, 3)) < 2
    errors = [np.mean(np.square(frames - truth)[:, far]) for frames in (raw, denoised)]
    assert errors[1] < errors[0] / 10, errors
    assert np.mean(np.square(denoised - truth)) < 0.5 * np.mean(np.square(raw - truth))
    assert denoised.mean() == pytest.approx(truth.mean(), rel=0.02)


def test_emission_while_the_camera_moves(command, tmp_path):
    """The window behind glass loses most of its black pixels and none of its light."""
    stage = pane(tmp_path, camera=MOVING_CAMERA)
    truth = play_emission(tmp_path, stage, 20, "--spp", 256)[8:]
    raw = play_emission(tmp_path, stage, 20, "--denoise", "off")[8:]
    denoised = play_emission(tmp_path, stage, 20)[8:]
    window = (truth > 3).all(axis=3)
    errors = [np.mean(np.square(frames - truth)[window]) for frames in (raw, denoised)]
    assert errors[1] < errors[0] / 2, errors
    assert np.mean(np.square(denoised - truth)) < np.mean(np.square(raw - truth))
    assert denoised.mean() == pytest.approx(raw.mean(), rel=0.03)


@pytest.mark.parametrize("camera", [harness.CAMERA, MOVING_CAMERA])
def test_emission_switched_off(command, tmp_path, camera):
    """Dark in the frame of the change, seen through glass and in it."""
    frames = play_emission(tmp_path, pane(tmp_path, camera=camera), 21)
    assert frames[19].mean() > 0.1 and frames[20].max() == 0


def test_a_wire_that_passes_a_window(command, tmp_path):
    """Something a pixel wide is as dark in every frame as it is, and leaves no trail."""
    wire = MOVER.replace("(-0.2, -0.2, 0), (0.2, -0.2, 0), (0.2, 0.2, 0), (-0.2, 0.2, 0)",
                         "(-0.04, -2, 0), (0.04, -2, 0), (0.04, 2, 0), (-0.04, 2, 0)")
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, WINDOW, harness.matte(0.6), WALL, wire)
    truth = play_emission(tmp_path, stage, 20, "--spp", 256)[4:]
    denoised = play_emission(tmp_path, stage, 20)[4:]
    window = truth.max(axis=0)
    covered = (truth < 0.7 * window) & (window > 3)
    assert denoised[covered].mean() == pytest.approx(truth[covered].mean(), rel=0.1)
    trail = np.roll(covered, 1, axis=0) & ~covered  # a frame later
    assert denoised[1:][trail[1:]].mean() == pytest.approx(truth[1:][trail[1:]].mean(), rel=0.05)


def test_small_lamps_switched_on(command, tmp_path):
    """A pixel wide; what was dark for ten frames does not hold them back."""
    bulbs = [bulb(f"Bulb{i}", (0.23 * (i % 10) - 1.0, 0.27 * (i // 10) - 0.5, 0), ".timeSamples = { 1: 0, 10: 0, 11: 20 }", 0.03)
             for i in range(40)]
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, WALL, harness.matte(0.6), *bulbs,
                                bulb("Lamp", (0, 1, 6), " = 10", 0.5))
    truth = play_emission(tmp_path, stage, 16, "--spp", 256)[10:].mean()
    assert play_emission(tmp_path, stage, 16)[10:].mean() == pytest.approx(truth, rel=0.15)


def test_paths_that_find_nothing(command, tmp_path):
    """Light on the wall behind glass, while something moves: pixels whose path is reflected into the void keep their history."""
    stage = pane(tmp_path, MOVER)
    truth = play(tmp_path, stage, 20, "--spp", 256)[12:]
    denoised = play(tmp_path, stage, 20)[12:]
    behind = (truth > 0.03).all(axis=(0, 3))
    assert np.mean(denoised[:, behind] < 0.2 * truth[:, behind]) < 0.01
    assert denoised[:, behind].mean() == pytest.approx(truth[:, behind].mean(), rel=0.05)


def test_what_does_not_light_the_scene(command, tmp_path):
    """Another camera that moves is no reason to doubt histories."""
    frames = []
    for place in ("xformOp:translate = (0, 0, 9)", "xformOp:translate.timeSamples = { 1: (0, 0, 9), 12: (0, 0, 5) }"):
        other = f'''
    def Camera "Other"
    {{
        double3 {place}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
'''
        stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, other, harness.LAMP, harness.matte(0.6), WALL)
        frames.append(play(tmp_path, stage, 12, "--camera", "Camera"))
    assert np.allclose(*frames, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("options, state", [
    (("-t", "raytrace"), "run"), (("-t", "raytrace", "--spp", 2), "skipped"), (("-t", "raytrace", "--time", 0.01), "skipped"),
    (("-t", "raytrace", "--denoise", "off"), "skipped"), (("-t", "pathtrace"), "skipped"),
    (("-t", "pathtrace", *TEMPORAL), "run")])
def test_when_it_runs(render, options, state):
    """Where nothing is asked for: single frames of techniques that are no references."""
    frame, = render("cornell_empty", *options, size=(16, 9)).stats["frames"]
    node, = [n for n in frame["nodes"] if n["name"] == "denoise"]
    assert node["state"] == state
    assert state == "run" or "denoise.mode" in node["reason"]


# ---- Open Image Denoise ------------------------------------------------------------------------

def test_open_image_denoise(render):
    """A trained filter on four samples: at least half of the error goes, and no more than 2% of the light."""
    truth = harness.reference("cornell_empty", harness.REFERENCE_SIZE)
    raw = render("cornell_empty", "-t", "reference", "--spp", 4, size=harness.REFERENCE_SIZE).image
    run = render("cornell_empty", "-t", "reference", "--spp", 4, "--denoise", "oidn", size=harness.REFERENCE_SIZE,
                 aovs=("color",))
    assert metrics.relmse(run.image, truth.image) < metrics.relmse(raw, truth.image) / 2
    assert metrics.mean_ratio(run.image, raw) == pytest.approx(1, abs=0.02)
    assert (run.aovs["color"] == run.image).all()


def test_open_image_denoise_missing(command, tmp_path):
    run = harness.run("render", "--imageWidth", 16, "--denoise", "oidn", harness.find_stage("cornell_empty"),
                      tmp_path / "image.pfm", env={"TRILUME_OIDN": str(tmp_path / "nowhere.so")})
    assert run.status == 2 and list(tmp_path.iterdir()) == []
    error, = run.errors
    assert harness.ERROR_LINE.fullmatch(error) and "tools/bootstrap --oidn" in error
