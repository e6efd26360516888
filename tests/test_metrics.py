"""The measures themselves: a measure that can't see an error would let every other test pass."""

import numpy as np
import pytest

from trilume_bench import metrics


def noisy(seed, count=1, bias=1.0, shape=(18, 32, 3)):
    """`count` images of radiance `bias`, with the skewed noise of an average over many paths."""
    return np.random.default_rng(seed).gamma(40, bias / 40, (count, *shape))


def test_pfm_round_trip(tmp_path):
    image = noisy(1)[0].astype("<f4")
    (tmp_path / "a.pfm").write_bytes(b"PF\n32 18\n-1.0\n" + image[::-1].tobytes())
    assert (metrics.read_image(tmp_path / "a.pfm") == image).all()


def test_exr_round_trip(tmp_path):
    image = noisy(1)[0].astype(np.float32)
    metrics.write_image(tmp_path / "a.exr", image)
    assert (metrics.read_image(tmp_path / "a.exr") == image).all()


def test_relmse_of_a_known_error():
    reference = np.full((2, 2, 3), 2.0)
    assert metrics.relmse(reference * 1.1, reference) == pytest.approx(0.2**2 / (4 + metrics.RELMSE_EPSILON))


def test_mean_ratio_respects_the_mask():
    image, mask = np.ones((4, 4, 3)), np.zeros((4, 4), bool)
    image[:2], mask[:2] = 3, True
    assert metrics.mean_ratio(image, np.ones((4, 4, 3)), mask) == 3


@pytest.mark.parametrize("t, degrees, expected", [(0, 5, 0.5), (2.015, 5, 0.05), (3.747, 4, 0.01), (5.408, 7, 0.0005)])
def test_student_tail_agrees_with_tables(t, degrees, expected):
    assert metrics.student_tail(t, degrees) == pytest.approx(expected, rel=2e-3)


def test_block_t_is_calibrated():
    """The largest |t| over the picture is rarely beyond its Bonferroni bound, and not always far below it."""
    chances = []
    for seed in range(200):
        t, degrees = metrics.block_t(noisy(seed, 4), np.ones((18, 32, 3)), 3)
        chances.append(metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size)
    assert np.mean(np.array(chances) < 0.05) < 0.1
    assert np.median(chances) < 2


def test_block_t_sees_a_local_bias():
    images = noisy(1, 4)
    images[:, 6:9, 9:12] *= 1.25
    t, degrees = metrics.block_t(images, np.ones((18, 32, 3)), 3)
    assert metrics.student_tail(np.abs(t).max(), degrees) * 2 * t.size < 1e-6


def test_block_t_leaves_masked_blocks_out():
    mask = np.ones((18, 32), bool)
    mask[0, 0] = False
    assert len(metrics.block_t(noisy(1), np.ones((18, 32, 3)), 3, mask)[0]) == 6 * 10 - 1


def test_slope_of_monte_carlo():
    samples = np.array([16, 64, 256, 1024])
    assert metrics.slope(samples, 3.0 / samples) == pytest.approx(-1)


def test_difference_is_red_where_too_bright():
    reference = np.ones((1, 3, 3))
    picture = metrics.difference(reference * np.array([1.2, 1.0, 0.8])[None, :, None], reference)
    assert picture[0].tolist() == [[255, 0, 0], [255, 255, 255], [0, 0, 255]]


def test_student_quantile_agrees_with_tables():
    assert metrics.student_quantile(0.95, 4) == pytest.approx(2.776, abs=2e-3)


def test_interval_covers_the_mean_as_often_as_it_says():
    random = np.random.default_rng(1)
    inside = [abs(mean - 3) <= width for mean, width in (metrics.interval(random.normal(3, 1, 5)) for _ in range(400))]
    assert 0.92 < np.mean(inside) < 0.98
    assert metrics.interval([1.0]) == (1.0, np.inf)


def test_darkening_of_one_light_in_five():
    single = noisy(1)[0]
    single[0, :5] = 0  # the paper leaves black pixels out
    assert metrics.darkening(0.2 * single, single) == pytest.approx((0.2, 0.2))


def test_noise_raises_the_papers_darkening_alone():
    image, single = np.random.default_rng(1).gamma(4, 0.25, (2, 90, 160, 3))
    papers, of_means = metrics.darkening(image, single)
    assert papers > 1.05 and of_means == pytest.approx(1, abs=0.02)


def test_class_bias_is_signed_and_leaves_dark_classes_out():
    reference = {"direct": np.full((8, 8, 3), 2.0), "indirect": np.ones((8, 8, 3)), "caustic": np.zeros((8, 8, 3))}
    classes = {"direct": reference["direct"], "indirect": 0.97 * reference["indirect"], "caustic": reference["caustic"]}
    found = metrics.class_bias(classes, reference)
    assert found.keys() == {"direct", "indirect"}
    assert found["direct"][0] == 0 and found["indirect"][0] == pytest.approx(-0.03)


def test_bias_lies_in_its_interval_as_often_as_it_says():
    inside = []
    for seed in range(200):
        value, width = metrics.bias(noisy(seed, bias=1.02)[0], np.ones((18, 32, 3)))
        inside.append(abs(value - 0.02) <= width)
    assert 0.9 < np.mean(inside) <= 0.99


def test_flicker_sees_noise_and_not_drift():
    frames = np.random.default_rng(1).normal(2, 0.1, (16, 18, 32, 3))
    assert metrics.flicker(frames) == pytest.approx(0.05, rel=0.05)
    assert metrics.flicker(np.linspace(1, 1.01, 16)[:, None, None, None] * np.ones((16, 2, 2, 3))) < 1e-3


@pytest.mark.parametrize("lag, expected", [(1, 0), (0.5, 4), (0.1, 22)])
def test_frames_until_a_change_shows(lag, expected):
    """An exponential history: the distance shrinks by 1 - lag each frame, to a tenth after log(0.1) / log(1 - lag)."""
    means = [1.0] * 8
    for _ in range(200):
        means.append(means[-1] + lag * (3 - means[-1]))
    assert abs(metrics.frames_until(means, 8) - expected) <= 1


def test_frames_until_counts_from_the_last_overshoot():
    assert metrics.frames_until([1, 1, 3, 3, 2, 3, 3, 3, 3, 3, 3, 3, 3, 3], 2) == 3
    assert metrics.frames_until([1.0] * 20, 10) is None


def test_drift_of_a_leaking_history():
    assert metrics.drift(np.full(90, 2.0)) == 0
    assert metrics.drift(2 * 0.9999 ** np.arange(9000)) < -0.4
    assert metrics.drift(1 + 1e-3 * np.arange(90) / 60) == pytest.approx(1e-3, rel=0.02)


def test_nonfinite_values_are_counted():
    image = np.ones((4, 4, 3))
    image[0, 0, 0], image[1, 1, 2] = np.nan, np.inf
    assert metrics.nonfinite(image) == 2


def test_display_mse_clips_lamps():
    lamp = np.full((2, 2, 3), 80.0)
    assert metrics.display_mse(lamp, 0.5 * lamp) == 0


def test_flip_is_zero_for_equal_pictures():
    pytest.importorskip("flip_evaluator")
    picture = noisy(1)[0]
    assert metrics.flip(picture, picture) == pytest.approx(0, abs=1e-6) and metrics.flip(2 * picture, picture) > 0.05


def falling(frames, truth=1.0, seed=5):
    """Against references whose own noise is that of 100 frames."""
    first, second = (noisy(seed + k, 100, truth).mean(axis=0) for k in range(2))
    samples = [2**k for k in range(9)]
    return samples, metrics.falling_errors(frames, first, second, samples)


def test_errors_fall_below_the_references_noise():
    samples, errors = falling(noisy(4, 256))
    assert metrics.slope(samples, errors) == pytest.approx(-1, abs=0.02)
    assert errors[0] == pytest.approx(1 / 40 / (1 + metrics.RELMSE_EPSILON), rel=0.02)


def test_errors_of_what_is_biased_or_repeats_itself_stop_falling():
    for frames in (noisy(4, 256, 1.05), np.repeat(noisy(4, 8), 32, axis=0)):
        samples, errors = falling(frames)
        assert metrics.slope(samples, errors) > -0.85
