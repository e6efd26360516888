"""Judgements of the stability suite. Each returns a Row; a check can fail, which its tests show with planted errors."""

from dataclasses import dataclass

import numpy as np

from . import metrics

WIDEST = 0.02  # a comparison whose interval is wider than this proves nothing


@dataclass(frozen=True)
class Row:
    case: str
    technique: str
    bound: str
    measured: str
    good: bool            # nothing speaks against it
    decided: bool = True  # and noise would not have hidden it


def finite(case, technique, images, dropped):
    """`dropped`: samples that the renderer counted as not finite and left out."""
    count = metrics.nonfinite(np.asarray(images)) + dropped
    return Row(case, technique, "0 values that are not finite", str(count), count == 0)


def ratio(case, technique, images, expected, bound):
    """Mean radiance over what is expected, within `bound`, as far as noise lets tell: lists of a picture for each seed.

    Pictures of one seed share most of their noise where the edit leaves paths as they are, so that the interval of a single
    pair, over blocks of pixels, can be narrow. Where they don't, noise that reaches over the picture needs several seeds.
    """
    if len(images) > 1:
        mean, width = metrics.interval([metrics.mean_ratio(a, b) - 1 for a, b in zip(images, expected)])
    else:
        mean, width = metrics.bias(images[0], expected[0])
    good = bool(np.isfinite(mean) and abs(mean) <= bound + width and width <= WIDEST)
    return Row(case, technique, f"1 +- {bound:g}", f"{1 + mean:.5f} +- {width:.1g}", good)


def drift(case, technique, levels, bound, comparisons=1):
    """Last third of a series that should be level against its first third; `comparisons` share the chance of an error."""
    levels = np.asarray(levels, np.float64)
    third = len(levels) // 3
    spread = np.sqrt((levels[:third].var(ddof=1) + levels[-third:].var(ddof=1)) / third) / levels.mean()
    width = metrics.student_quantile(1 - 0.05 / comparisons, 2 * (third - 1)) * spread
    measured = metrics.drift(levels)
    good = bool(np.isfinite(measured) and abs(measured) <= bound + width and width <= WIDEST)
    return Row(case, technique, f"drift within {100 * bound:g}%", f"{100 * measured:+.3f}% +- {100 * width:.2g}%", good, bool(width <= bound))


def none(case, technique, what, count):
    return Row(case, technique, f"0 {what}", str(count), count == 0)


def flat(case, technique, what, values, bound):
    """The most of the last third is no more than `bound` (a share) above the most of the middle third."""
    values = np.asarray(values, np.float64)
    third = len(values) // 3
    growth = values[-third:].max() / values[third:2 * third].max() - 1
    return Row(case, technique, f"{what} grows by at most {100 * bound:g}%", f"{100 * growth:+.2f}%", bool(growth <= bound))
