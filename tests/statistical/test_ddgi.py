"""Irradiance probes: exact solutions, agreement with path tracing, sleep and waking. The whole picture: tests/image."""

import json

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux

import harness
import metrics

DDGI = ("-t", "ddgi")
FINAL = ("--set", "ddgi.gather=final")
FEW = ("--set", "ddgi.probes=512")


def indirect(render, folder, stage, *options, count=1):
    """(mean picture of the indirect class over seeds, statistics of the last run)."""
    pictures = []
    for seed in range(1, count + 1):
        file = folder / f"indirect{seed}.pfm"
        stats = render(stage, *options, "--seed", seed, "--aov", f"indirect={file}").stats
        pictures.append(metrics.read_image(file))
    return np.mean(pictures, axis=0), stats["frames"][-1]


# ---- exact solutions ---------------------------------------------------------------------------

def furnace(folder, albedo=0.8, scale=1.0, emission=1.0):
    """A closed cube seen from within, which emits and reflects everywhere alike."""
    points = str([(scale * x, scale * y, scale * z) for z in (-2, 2) for y in (-2, 2) for x in (-2, 2)])
    cube = harness.mesh(points, "[4, 4, 4, 4, 4, 4]",
                        "[0, 4, 5, 1, 2, 3, 7, 6, 0, 1, 3, 2, 0, 2, 6, 4, 1, 5, 7, 3, 4, 6, 7, 5]")
    place = tuple(scale * c for c in (0.3, 0.2, 1.5))
    camera = harness.CAMERA.replace("(0, 0, 4)", str(place)).replace("(0.01, 1000)", "(1e-6, 1e9)")
    return harness.write_stage(folder / "furnace.usda", camera, cube, harness.matte(albedo, emission))


@pytest.mark.parametrize("gather", ["probe", "final"])
def test_closed_furnace(render, tmp_path, gather):
    """Emission 1 and albedo 0.6 everywhere: rho^2 / (1 - rho) of two and more bounces. The light samples of 64 rays of 125
    probes have a standard error near 1%, of a round; it counts 1 / (1 - rho) fold, and 256 rounds weigh as 85."""
    options = (*DDGI, "--warmup", 250, "--spp", 8 if gather == "probe" else 64, "--set", "ddgi.probes=125",
               "--set", "ddgi.tolerance=0", "--set", f"ddgi.gather={gather}")
    picture, _ = indirect(render, tmp_path, furnace(tmp_path, 0.6), *options)
    assert picture.mean() == pytest.approx(0.36 / 0.4, rel=0.005)
    assert metrics.block_means(picture, 6) == pytest.approx(0.36 / 0.4, rel=0.03)


@pytest.mark.parametrize("scale, emission", [(1e-3, 1), (1e3, 1), (1, 1e-5), (1, 1e5)])
def test_scaled_furnace(render, tmp_path, scale, emission):
    """The same image, and the same times the emission."""
    options = (*DDGI, "--warmup", 2, *FEW)
    expected, _ = indirect(render, tmp_path, furnace(tmp_path), *options)
    picture, _ = indirect(render, tmp_path, furnace(tmp_path, scale=scale, emission=emission), *options)
    # A factor that is no power of two rounds differently; a ray in a few thousand then goes another way.
    assert np.median(np.abs(picture / emission / expected - 1)) < 1e-3
    assert picture.mean() / emission == pytest.approx(expected.mean(), rel=5e-3)


# ---- agreement with path tracing ---------------------------------------------------------------

AGREE = [("cornell_empty", "probe", 0.03), ("one_box", "probe", 0.03), ("one_box", "final", 0.02)]
if harness.FULL:
    AGREE = [(s, g, b) for s in ("cornell_empty", "cornell_big_light", "one_box", "maze", "white_room")
             for g, b in (("probe", 0.03), ("final", 0.02))]


@pytest.mark.parametrize("stage, gather, bias", AGREE)
def test_agrees_with_path_tracing(render, tmp_path, stage, gather, bias):
    """The class's mean within the bias budget of README.md."""
    expected, _ = indirect(render, tmp_path, stage, "-t", "pathtrace", "--spp", 1024)
    picture, frame = indirect(render, tmp_path, stage, *DDGI, "--warmup", 16, "--spp", 4 if gather == "probe" else 128,
                              "--set", f"ddgi.gather={gather}")
    assert frame["nonfinite"] == 0
    assert metrics.mean_ratio(picture, expected) == pytest.approx(1, abs=bias)
