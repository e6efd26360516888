"""The measures themselves: a measure that can't see an error would let every other test pass."""

import numpy as np
import pytest
from report import difference

import metrics


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
    picture = difference(reference * np.array([1.2, 1.0, 0.8])[None, :, None], reference)
    assert picture[0].tolist() == [[255, 0, 0], [255, 255, 255], [0, 0, 255]]
