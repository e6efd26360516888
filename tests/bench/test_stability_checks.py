"""The stability suite sees what it is there for: errors planted in measurements of a renderer without fault."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from trilume_bench import bench, checks  # noqa: E402
from trilume_bench.suites import stability  # noqa: E402

NAMES = ("base", "scale 1e-05 by transform", "emission 100000", "furnace, IOR 1.5")
FRAMES = 40 * stability.PERIOD


def picture(seed=1):
    width, height = stability.SIZE
    return np.random.default_rng(seed).gamma(20, 1 / 20, (height, width, 3)).astype(np.float32)


def measured():
    """Results of a renderer whose pictures of one seed are equal, and whose furnace is white."""
    def result(image, **numbers):
        return bench.Result(bench.Job("average", 1), {"nonfinite": 0, **numbers}, {"image": image})

    means = 1 + 0.3 * np.sin(2 * np.pi * np.arange(FRAMES) / stability.PERIOD)
    means += np.random.default_rng(2).normal(0, 0.002, FRAMES)
    return {
        ("base", "hybrid", 0): result(picture()), (NAMES[1], "hybrid", 0): result(picture()),
        (NAMES[2], "hybrid", 0): result(1e5 * picture()), (NAMES[3], "hybrid", 0): result(np.ones_like(picture())),
        ("soak", "hybrid", 0): result(None, means=means.tolist(), memory_bytes=[5_000_000] * FRAMES,
                                   resident_kb=[90_000 + k % 7 for k in range(200)]),
    }


def failures(results):
    rows, _ = stability.judge(NAMES, ["hybrid"], results)
    return [(r.case, r.bound) for r in rows if not r.good]


def test_a_faultless_renderer_passes():
    assert failures(measured()) == []


def test_a_nan_is_caught():
    results = measured()
    results[NAMES[1], "hybrid", 0].arrays["image"][3, 4, 1] = np.nan
    assert (NAMES[1], "0 values that are not finite") in failures(results)


def test_a_sample_that_the_renderer_dropped_is_caught():
    results = measured()
    results[NAMES[2], "hybrid", 0].numbers["nonfinite"] = 1
    assert failures(results) == [(NAMES[2], "0 values that are not finite")]


@pytest.mark.parametrize("name, leak", [(NAMES[1], 0.997), (NAMES[2], 1.003), (NAMES[3], 0.993)])
def test_an_energy_leak_is_caught(name, leak):
    results = measured()
    results[name, "hybrid", 0].arrays["image"][...] *= leak
    assert [case for case, _ in failures(results)] == [name]


def test_a_leak_of_some_pixels_is_caught():
    """Not in proportion to the light: noise of unequal blocks must not hide it."""
    results = measured()
    results[NAMES[1], "hybrid", 0].arrays["image"][:, :32] *= 0.97
    assert NAMES[1] in [case for case, _ in failures(results)]


def test_a_drifting_history_is_caught():
    results = measured()
    means = results["soak", "hybrid", 0].numbers["means"]
    means[:] = (np.array(means) * (1 + 1e-5 * np.arange(FRAMES))).tolist()
    assert failures(results) == [(f"soak of {FRAMES} frames", "drift within 0.1%")]


def test_growing_memory_is_caught():
    results = measured()
    numbers = results["soak", "hybrid", 0].numbers
    numbers["memory_bytes"][-1] += 4096
    numbers["resident_kb"] = [90_000 + 20 * k for k in range(200)]
    assert [bound for _, bound in failures(results)] == ["device memory grows by at most 0%", "resident memory grows by at most 1%"]


def test_noise_is_no_pass():
    """Pictures too noisy to compare prove nothing."""
    noise = np.random.default_rng(3).gamma(0.01, 100, (36, 64, 3))
    assert not checks.ratio("case", "hybrid", [noise], [np.ones((36, 64, 3))], 1e-3).good
