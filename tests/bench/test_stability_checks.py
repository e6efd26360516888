"""The stability suite sees what it is there for: errors planted in measurements of a renderer without fault."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from trilume_bench import bench, checks  # noqa: E402
from trilume_bench.suites import stability  # noqa: E402

NAMES = ("base", "scale 1e-05 by transform", "emission 100000", "furnace, IOR 1.5")
LOOPS = 90
SOAK = "soak", stability.SWITCHED, 0


def picture(seed=1):
    width, height = stability.SIZE
    return np.random.default_rng(seed).gamma(20, 1 / 20, (height, width, 3)).astype(np.float32)


def measured():
    """Results of a renderer whose pictures of one seed are equal, and whose furnace is white."""
    def result(image, **numbers):
        return bench.Result(bench.Job("average", 1), {"nonfinite": 0, **numbers}, {"image": image})

    noise = np.random.default_rng(2).normal(0, 0.001, (2, LOOPS))
    phases = [{"name": "steady", "frames": 8, "means": (1 + noise[0]).tolist()},
              {"name": "bpt", "frames": 2, "means": (0.5 + noise[1]).tolist()},
              {"name": "resized", "frames": 2, "means": [0.7] * LOOPS}]
    return {
        ("base", "hybrid", 0): result(picture()), (NAMES[1], "hybrid", 0): result(picture()),
        (NAMES[2], "hybrid", 0): result(1e5 * picture()), (NAMES[3], "hybrid", 0): result(np.ones_like(picture())),
        SOAK: result(None, frames=12 * LOOPS, phases=phases, changed_after_reload=0, memory_bytes=[5_000_000] * LOOPS,
                     resident_bytes=[90_000_000 + 1000 * (k % 7) for k in range(LOOPS)]),
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
    for phase in results[SOAK].numbers["phases"][:2]:
        phase["means"] = (np.array(phase["means"]) * (1 + 5e-5 * np.arange(LOOPS))).tolist()
    assert (f"soak of {12 * LOOPS} frames", "drift within 0.1%") in failures(results)


def test_a_drift_of_one_phase_is_caught():
    results = measured()
    phase = results[SOAK].numbers["phases"][1]
    phase["means"] = (np.array(phase["means"]) * (1 + 1e-4 * np.arange(LOOPS))).tolist()
    assert failures(results) == [(f"soak of {12 * LOOPS} frames, bpt", "drift within 0.1%")]


@pytest.mark.parametrize("plant", [lambda n: n.update(changed_after_reload=1), lambda n: n["phases"][2]["means"].__setitem__(7, 0.7001)])
def test_a_picture_that_changed_is_caught(plant):
    results = measured()
    plant(results[SOAK].numbers)
    assert len(failures(results)) == 1 and "pictures that differ" in failures(results)[0][1]


def test_growing_memory_is_caught():
    results = measured()
    numbers = results[SOAK].numbers
    numbers["memory_bytes"][-1] += 4096
    numbers["resident_bytes"] = [90_000_000 + 50_000 * k for k in range(LOOPS)]
    assert [bound for _, bound in failures(results)] == ["device memory grows by at most 0%", "resident memory grows by at most 1%"]


def test_noise_is_no_pass():
    """Pictures too noisy to compare prove nothing."""
    noise = np.random.default_rng(3).gamma(0.01, 100, (36, 64, 3))
    assert not checks.ratio("case", "hybrid", [noise], [np.ones((36, 64, 3))], 1e-3).good
