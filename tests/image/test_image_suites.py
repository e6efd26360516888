"""Runs the JSON suites of this folder: pictures against stored references, with a page of differences on failure.

A suite gives technique, flags, seeds, spp, tolerance and images; an image may override each, and names its stage and
reference (default: the stage's name). AOVs that it names are for other tests, which share its renders. Tolerances, judged
on the mean of the seeds' images:

    mean          relative error of mean radiance, away from pixels that show a lamp
    relmse        metrics.relmse, all pixels
    significance  chance that a correct renderer fails the test of local bias: Student's t of the mean residual of each
                  block of pixels and channel, corrected for their number

What is marked `full`, a suite or an image, runs with TRILUME_FULL=1 only. `pytest -s` shows what was measured.
"""

import json
from pathlib import Path

import numpy as np
import pytest

import harness
import report
from trilume_bench import metrics

HERE = Path(__file__).resolve().parent
BLOCK = harness.SIZE[1] // 6  # pixels


def cases():
    for file in sorted(HERE.glob("*.json")):
        suite = json.loads(file.read_text())
        shared = {k: v for k, v in suite.items() if k not in ("description", "images", "tolerance", "flags")}
        for image in suite["images"]:
            case = {**shared, "reference": image["stage"], **image}
            if case.get("full") and not harness.FULL:
                continue
            case["flags"] = suite["flags"] + image.get("flags", [])
            case["tolerance"] = {**suite["tolerance"], **image.get("tolerance", {})}
            yield pytest.param(case, id=f"{file.stem}-{case['stage']}-{case['reference']}")


@pytest.mark.parametrize("case", cases())
def test_image(case, render, request):
    images = render.seeds(case["stage"], "-t", case["technique"], "--spp", case["spp"], *case["flags"],
                          count=case["seeds"], aovs=case.get("aovs", ()))
    reference = harness.reference(case["reference"])
    facts, good = judge(images, reference, case["tolerance"])
    title = f"{case['stage']}, {case['technique']}, {case['seeds']} x {case['spp']} spp"
    print(f"{title}: {'; '.join(facts)}")
    if not good:
        report.add(request.node.callspec.id, title, images.mean(axis=0), reference.image, facts)
    assert good, f"{title}: {'; '.join(facts)}: see {harness.BUILD}/test-report/index.html"


def judge(images, reference, tolerance):
    """(facts to print, whether all tolerances are kept)."""
    image, elsewhere = images.mean(axis=0), ~reference.lamp
    ratio = metrics.mean_ratio(image, reference.image, elsewhere)
    ratios = [metrics.mean_ratio(i, reference.image, elsewhere) for i in images]
    relmse = metrics.relmse(image, reference.image)
    t, degrees = metrics.block_t(images, reference.image, BLOCK, elsewhere)
    # Two-sided, and corrected for the number of tests by Bonferroni.
    chance = metrics.student_tail(float(np.abs(t).max()), degrees) * 2 * t.size
    facts = [f"mean ratio {ratio:.5f} +- {metrics.confidence(ratios)[1]:.5f}", f"relMSE {relmse:.3g}",
             f"largest |t| of a block {np.abs(t).max():.1f}, by chance {min(chance, 1):.1g}"]
    kept = {"mean": lambda limit: abs(ratio - 1) <= limit, "relmse": lambda limit: relmse <= limit,
            "significance": lambda limit: chance >= limit}
    return facts, all(kept[key](limit) for key, limit in tolerance.items() if limit is not None)
