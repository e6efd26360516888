"""Stages driven through time: pictures per frame, what was rebuilt, resuming and interrupting."""

import json
import re
import time

import numpy as np
import pytest

import harness
from trilume_bench import metrics

FRAMES = 24
WIDTH, HEIGHT = harness.SIZE
SIZE = ("--imageWidth", WIDTH, "--imageHeight", HEIGHT)
PFM_BYTES = len(f"PF\n{WIDTH} {HEIGHT}\n-1.0\n") + 12 * WIDTH * HEIGHT


@pytest.fixture(scope="module")
def played(command, tmp_path_factory):
    """(folder of out.####.pfm, stats) of all frames of `animated`."""
    folder = tmp_path_factory.mktemp("playback")
    done = harness.run("render", *SIZE, "-t", "pathtrace", "--spp", 256, "-f", f"1:{FRAMES}", "--stats",
                       folder / "stats.json", harness.CONTENT / "animated.usda", folder / "out.####.pfm")
    assert done.status == 0, done.stderr
    return folder, json.loads((folder / "stats.json").read_text())


def frame_file(folder, frame):
    return folder / f"out.{frame:04d}.pfm"


def accel(frame):
    return tuple(frame["accel"][k] for k in ("blas_built", "blas_refit", "tlas_built"))


def test_every_frame_is_written(played):
    folder, stats = played
    assert sorted(p.name for p in folder.glob("*.pfm")) == [f"out.{f:04d}.pfm" for f in range(1, FRAMES + 1)]
    assert [f["frame"] for f in stats["frames"]] == list(range(1, FRAMES + 1))
    assert all(f["nonfinite"] == 0 for f in stats["frames"])


@pytest.mark.parametrize("frame", [1, 12, 24])
def test_frames_agree_with_their_references(played, frame):
    """256 samples: sixteen times the relMSE that 4096 may have, and the mean within 5 standard errors of about 0.1%."""
    image, reference = metrics.read_image(frame_file(played[0], frame)), harness.reference(f"animated.{frame:04d}")
    assert metrics.relmse(image, reference.image) < 16 * 1e-3
    assert metrics.mean_ratio(image, reference.image, ~reference.lamp) == pytest.approx(1, abs=0.006)


def test_every_frame_differs_from_its_neighbours(played):
    """The lamp, the ring and the camera move with each frame: more changes than noise."""
    images = [metrics.read_image(frame_file(played[0], f)) for f in range(1, FRAMES + 1)]
    assert all(metrics.relmse(a, b) > 2e-3 for a, b in zip(images, images[1:]))


def test_moving_things_rebuild_the_top_level_only(played):
    frames = played[1]["frames"]
    assert accel(frames[0])[0] >= 1 and accel(frames[0])[2] == 1
    assert all(accel(f) == (0, 0, 1) for f in frames[1:])
    assert all(0 < f["uploaded_bytes"] < frames[0]["uploaded_bytes"] / 10 for f in frames[1:])


def test_nodes_that_ran(played):
    for frame in played[1]["frames"]:
        states = {n["name"]: n["state"] for n in frame["nodes"]}
        assert states["visibility"] == states["pathtrace"] == "run"


def test_a_frame_does_not_depend_on_those_before_it(played, render):
    """Played or rendered alone: the same bits, for a technique without history."""
    alone = render("animated", "-t", "pathtrace", "--spp", 256, "-f", 12).image
    assert (alone == metrics.read_image(frame_file(played[0], 12))).all()


def test_static_stage_builds_and_uploads_nothing_after_its_first_frame(command, tmp_path):
    done = harness.run("render", *SIZE, "-t", "hybrid", "-f", "1:3", "--stats", tmp_path / "stats.json",
                       harness.CONTENT / "cornell_glass.usda", tmp_path / "out.####.pfm")
    assert done.status == 0, done.stderr
    frames = json.loads((tmp_path / "stats.json").read_text())["frames"]
    assert accel(frames[0])[0] >= 1 and frames[0]["uploaded_bytes"] > 1000
    assert [(*accel(f), f["uploaded_bytes"]) for f in frames[1:]] == [(0, 0, 0, 0)] * 2
    assert all(0 < f["host_ms"] < f["ms"] for f in frames)


def test_photons_of_a_still_picture_settle(command, tmp_path):
    """An eighth of them after eight still frames, all of them when something moves; none where nothing is remembered."""
    plate = harness.mesh(extra="""double3 xformOp:translate.timeSamples = {1: (1, 0, 0), 12: (1, 0, 0), 13: (1.5, 0, 0)}
        uniform token[] xformOpOrder = ["xformOp:translate"]""")
    ball = """    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 0.3
        double3 xformOp:translate = (0, 0, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel material:binding = </World/Glass>
    }
"""
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, harness.matte(), harness.GLASS, harness.LAMP, plate,
                                ball)

    def photons(*flags):
        done = harness.run("render", *SIZE, "-t", "hybrid", "--denoise", "off", "-f", "1:13", *flags, "--stats",
                           tmp_path / "stats.json", stage, tmp_path / "out.####.pfm")
        assert done.status == 0, done.stderr
        return [f["photons"] for f in json.loads((tmp_path / "stats.json").read_text())["frames"]]

    counts = photons()
    assert counts[8:12] == [counts[7] // 8] * 4 and counts[12] == counts[7]
    assert photons("--set", "caustics.historyFrames=1")[11] >= counts[7] // 2


DEFORMING = harness.mesh(points=f"""{harness.SQUARE_POINTS}
        point3f[] points.timeSamples = {{
            1: [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)],
            2: [(-1, -1, 0), (1, -1, 0), (1, 0, 0), (-1, 0, 0)],
        }}""")


def test_deforming_mesh_is_refit(command, tmp_path):
    """Points with time samples: the mesh is refit, not rebuilt, and is seen where it is."""
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, harness.matte(), DEFORMING,
                                '    def DomeLight "Dome"\n    {\n        float inputs:intensity = 1\n    }\n')
    done = harness.run("render", "--imageWidth", 32, "--imageHeight", 18, "-t", "pathtrace", "--spp", 64, "-f", "1,2",
                       "--stats", tmp_path / "stats.json", stage, tmp_path / "out.####.pfm")
    assert done.status == 0, done.stderr
    first, second = json.loads((tmp_path / "stats.json").read_text())["frames"]
    assert accel(first)[0] == 1 and accel(second)[:2] == (0, 1)
    # The upper half of the square (radiance 0.8) has given way to the dome (1).
    images = [metrics.read_image(frame_file(tmp_path, f)) for f in (1, 2)]
    above, below = (slice(3, 7), slice(14, 18)), (slice(11, 15), slice(14, 18))
    assert [images[0][above].mean(), images[1][above].mean()] == pytest.approx([0.8, 1.0], rel=0.02)
    assert [i[below].mean() for i in images] == pytest.approx([0.8, 0.8], rel=0.02)


@pytest.mark.parametrize("spec, frames", [("3", [3]), ("1:5x2", [1, 3, 5]), ("2,7:8", [2, 7, 8])])
def test_frame_specs(command, tmp_path, spec, frames):
    done = harness.run("render", *SIZE, "-t", "raytrace", "-f", spec, harness.CONTENT / "animated.usda",
                       tmp_path / "out.####.pfm")
    assert done.status == 0, done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"out.{f:04d}.pfm" for f in frames]


def test_default_frame_is_the_stage_s_start(render):
    flags = ("-t", "raytrace", "--spp", 4)
    assert (render("animated", *flags).image == render("animated", *flags, "-f", 1).image).all()


def test_stage_without_a_range_is_shown_at_its_first_samples(command, tmp_path):
    """The lamp shines at -10 only: at 0 it would be dark."""
    lamp = """
    def DomeLight "Dome"
    {
        float inputs:intensity.timeSamples = { -10: 1, -9: 0, 10: 0 }
    }
"""
    stage = harness.write_stage(tmp_path / "stage.usda", harness.CAMERA, harness.matte(), harness.mesh(), lamp)
    done = harness.run("render", "--imageWidth", 16, "-t", "raytrace", stage, tmp_path / "out.pfm")
    assert done.status == 0, done.stderr
    assert metrics.read_image(tmp_path / "out.pfm").mean() > 0.1


# ---- resuming and interrupting -----------------------------------------------------------------

def test_resume_makes_what_is_missing_or_cut_short(command, tmp_path):
    arguments = ("render", *SIZE, "-t", "raytrace", "--denoise", "off", "-f", "1:4", harness.CONTENT / "animated.usda",
                 tmp_path / "out.####.pfm")
    assert harness.run(*arguments).status == 0
    files = [frame_file(tmp_path, f) for f in range(1, 5)]
    contents = [f.read_bytes() for f in files]
    files[1].unlink()
    files[2].write_bytes(contents[2][:100])
    kept = [files[i].stat().st_mtime_ns for i in (0, 3)]
    time.sleep(0.02)
    done = harness.run(*arguments[:1], "--resume", *arguments[1:])
    assert done.status == 0, done.stderr
    assert [f.read_bytes() for f in files] == contents
    assert [files[i].stat().st_mtime_ns for i in (0, 3)] == kept
    done = harness.run(*arguments[:1], "--resume", "--stats", tmp_path / "stats.json", *arguments[1:])
    assert done.status == 0, done.stderr
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert stats["frames"] == [] and stats["width"] == WIDTH


def wait_for(condition, process, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, f"ended with {process.returncode}: {process.stderr.read()}"
        assert time.monotonic() < end, "took too long"
        time.sleep(0.05)


def test_interrupt_leaves_whole_frames_only(command, tmp_path):
    """Ctrl-C in the midst of a sequence: frames so far stand, nothing half-written does, and it says so."""
    process = harness.start("render", *SIZE, "-t", "pathtrace", "--spp", 300, "-f", f"1:{FRAMES}",
                            harness.CONTENT / "animated.usda", tmp_path / "out.####.pfm")
    wait_for(lambda: frame_file(tmp_path, 2).exists(), process, 120)
    status, stderr = harness.interrupt(process)
    assert status != 0
    written = sorted(tmp_path.iterdir())
    assert 2 <= len(written) < FRAMES
    assert [p.name for p in written] == [f"out.{f:04d}.pfm" for f in range(1, len(written) + 1)]
    assert all(np.isfinite(metrics.read_image(p)).all() for p in written)
    assert re.search(r"interrupted", stderr) and str(len(written)) in stderr, stderr
    assert "Traceback" not in stderr


def test_interrupt_of_one_long_frame(command, tmp_path):
    """Far from the end of a single picture: it ends within a second or so. What is there, if anything, is whole."""
    output = tmp_path / "out.pfm"
    process = harness.start("render", *SIZE, "-t", "pathtrace", "--spp", 100000000, harness.CONTENT / "cornell_empty.usda", output)
    time.sleep(6)
    begun = time.monotonic()
    status, stderr = harness.interrupt(process)
    assert time.monotonic() - begun < 5
    assert status != 0 and "interrupted" in stderr, stderr
    assert set(tmp_path.iterdir()) <= {output}
    if output.exists():
        assert output.stat().st_size == PFM_BYTES


# ---- time given instead of samples -------------------------------------------------------------

def test_time_budget(render):
    """--time 1: about a second of rendering, and as many samples as fit."""
    frame, = render("cornell_empty", "-t", "pathtrace", "--time", 1).stats["frames"]
    assert frame["spp"] > 1 and 900 < frame["ms"] < 2500


def test_target_ms_takes_effort_and_nothing_else(command, tmp_path):
    """A target that can't be met takes all effort: noisier frames of the same light. One that is met changes no bit."""
    def played(name, *target):
        folder = tmp_path / name
        folder.mkdir()
        done = harness.run("render", *SIZE, "-t", "hybrid", "--denoise", "off", *target, "-f", f"1:{FRAMES}", "--stats",
                           folder / "stats.json", harness.CONTENT / "animated.usda", folder / "out.####.pfm")
        assert done.status == 0, done.stderr
        frames = json.loads((folder / "stats.json").read_text())["frames"]
        return [f["effort"] for f in frames], sum(f["rays"] for f in frames[-8:]), \
            np.stack([metrics.read_image(frame_file(folder, f)) for f in range(1, FRAMES + 1)])

    (plain, plain_rays, plain_images), (met, _, met_images) = played("plain"), played("met", "--target-ms", 1e6)
    missed, missed_rays, missed_images = played("missed", "--target-ms", 0.001)
    assert plain == met == [1] * FRAMES and np.array_equal(plain_images, met_images)
    assert missed[0] == 1 and missed[-1] == 0 and missed == sorted(missed, reverse=True)
    assert missed_rays < 0.7 * plain_rays, (missed_rays, plain_rays)
    # Probes follow the moving lamp more slowly.
    assert missed_images[-8:].mean() == pytest.approx(plain_images[-8:].mean(), rel=0.05)
