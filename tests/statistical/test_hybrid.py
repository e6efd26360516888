"""The hybrid against path tracing, path class by path class: its bias is bounded, and its errors are what the README says."""

import numpy as np
import pytest

import harness
from trilume_bench import metrics
from harness import CLASSES

SCENES = {
    "cornell_empty": (), "cornell_big_light": (), "cornell_glass": (), "cornell_light_sphere": (), "one_box": (),
    "five_boxes": (), "maze": (), "white_room": (), "animated": ("--frames", 12),
}
CASES = SCENES if harness.FULL else ("cornell_glass", "white_room")
HYBRID = ("-t", "hybrid", "--warmup", 32, "--spp", 512 if harness.FULL else 32)
SEEDS = 3 if harness.FULL else 2
# The image suite's own renders; caustics are beyond path tracing.
PATHTRACE, BPT = ("-t", "pathtrace", "--spp", 2048), ("-t", "bpt", "--spp", 512)

# |mean ratio - 1|, as quality.md has it.
OVERALL, PER_CLASS, FINAL_GATHER = 0.01, 0.03, 0.005
# A class that makes less than this share of the light is judged by the whole picture only.
MINOR = 0.005


def class_means(runs, where):
    """{class or `all`: (mean, standard error)} over runs, of pixels `where`."""
    pictures = {"all": [r.image for r in runs], **{c: [r.aovs[c] for r in runs] for c in CLASSES}}
    return {name: metrics.confidence([p[where].mean() for p in images]) for name, images in pictures.items()}


def bias(render, stage, *options):
    """{class or `all`: (signed relative bias, its standard error, share of the light)} away from lamps."""
    flags = SCENES[stage]
    reference = {"animated": "animated.0012", "five_boxes": "one_box"}.get(stage, stage)
    where = ~harness.reference(reference).lamp
    technique = BPT if stage == "cornell_glass" else PATHTRACE
    truth = class_means(render.runs(stage, *technique, *flags, count=2, aovs=CLASSES), where)
    found = class_means(render.runs(stage, *HYBRID, *flags, *options, count=SEEDS, aovs=CLASSES), where)
    result = {}
    for name, (mean, error) in truth.items():
        if mean > MINOR * truth["all"][0]:
            other, spread = found[name]
            result[name] = (other / mean - 1, np.hypot(error, spread) / mean, mean / truth["all"][0])
    return result


def report(stage, found):
    print(stage, "; ".join(f"{n} {100 * b:+.2f}% +- {100 * e:.2f}% of {100 * s:.0f}%" for n, (b, e, s) in found.items()))


@pytest.mark.parametrize("stage", CASES)
def test_bias_with_probes_at_the_visible_point(render, stage):
    found = bias(render, stage)
    report(stage, found)
    for name, (deviation, error, _) in found.items():
        assert abs(deviation) < (OVERALL if name == "all" else PER_CLASS) + 3 * error, (name, found)


@pytest.mark.parametrize("stage", CASES)
def test_bias_with_final_gather(render, stage):
    found = bias(render, stage, "--set", "ddgi.gather=final")
    report(stage, found)
    for name, (deviation, error, _) in found.items():
        assert abs(deviation) < (FINAL_GATHER if name == "all" else PER_CLASS) + 3 * error, (name, found)


def test_no_path_class_is_left_out(render):
    frame, = render("cornell_glass", *HYBRID, "--seed", 1, aovs=CLASSES).stats["frames"]
    assert frame["unowned"] == [] and frame["nonfinite"] == 0
    assert {n["name"]: n["state"] for n in frame["nodes"]}["caustics"] == "run"


def test_nodes_that_a_scene_does_not_need_are_skipped(render):
    frame, = render("cornell_empty", "-t", "hybrid", "--warmup", 4, "--spp", 2).stats["frames"]
    nodes = {n["name"]: n for n in frame["nodes"]}
    assert nodes["caustics"]["state"] == "skipped" and nodes["caustics"]["reason"]
    assert frame["unowned"] == []  # there is no such light


@pytest.mark.parametrize("node, left", [("caustics", ["caustic"]), ("ddgi", ["indirect"]), ("restir_di", ["direct"])])
def test_a_node_that_is_off_leaves_its_class_without_an_owner(render, node, left):
    run = render("cornell_glass", "-t", "hybrid", "--warmup", 4, "--spp", 2, "--disable", node)
    assert run.stats["frames"][0]["unowned"] == left
