"""Extreme scales, shapes, lights and materials, and long animations: what must not change, and what must not appear.

Each case compares the mean radiance of a stage with that of its unedited self, or with a closed form; both are rendered with
the same seed. Every case also counts values that are not finite.
"""

from dataclasses import dataclass

import numpy as np

from .. import checks, metrics, stages
from .. import report as draw
from ..bench import Job
from ..report import percent

TECHNIQUES = ("hybrid", "reference", "bpt", "restir")
SIZE = (64, 36)
SOAK_SIZE = (48, 27)
# Few probes, updated by few rays, so that ten thousand frames pass in minutes.
SOAK_OPTIONS = ("--set", "ddgi.probes=512", "--set", "ddgi.budget=4096")
# A dim lamp, so that next to nothing is clipped, steps to four times its radiance at one frame, and all is at rest again.
STEP, STEP_FRAMES = 16, 64
RESPONDING = ("restir", "ddgi_restir", "hybrid")
SOAK_PERIOD = 50  # frames of the stage's motion, over which each loop of the soak is stretched
SWITCHED = "all that is switched"
BASE = "cornell_glass"
SEEDS = 4
# Its target. Interpolated roots of irradiance are not additive: the light of two lamps is more than what each alone would
# leave, by a part of the bias of interpolation.
HYBRID_BIAS = 1e-2


@dataclass(frozen=True)
class Case:
    """`edits` of the content stage `source`, whose radiance is `factor` times the sum of that of the stages `expected`."""

    source: str
    edits: tuple = ()
    expected: tuple = ()       # names of other cases; empty: `constant`
    factor: float = 1.0
    constant: float = 1.0
    bound: float = 1e-3        # of the mean's ratio
    hybrid_bound: float = 0.0  # of that of `hybrid`, where it is another
    make: object = None        # writes a stage that is no edited one
    techniques: tuple = TECHNIQUES
    quick: bool = True
    seeds: int = 1             # pictures to judge by, where the edit leaves no path as it was


def _scale(factor, by, quick):
    return Case(BASE, (by(factor),), ("base",), quick=quick)


def _emission(factor, quick):
    return Case(BASE, (stages.emission(factor),), ("base",), factor=factor, quick=quick)


# Behind the camera of one_box, where only what it lights is seen; power is held while the radius shrinks.
BEHIND, POWER = (0.3, 1.5, 1.9), 0.5


def _bulb(radius, **more):
    return Case("one_box", (stages.without_lights, stages.bulb("/World/Bulb", BEHIND, radius, POWER / radius**2)), **more)


def _two_lights(first, second):
    """Two bulbs of equal power whose radiances differ by 1e8 as their areas do; either may be dark, and then still blocks light."""
    return (stages.without_lights,
            stages.bulb("/World/Wide", BEHIND, 0.1, (1.0 if first else 1e-9) * POWER / 0.1**2),
            stages.bulb("/World/Fine", (-0.9, 1.5, 1.9), 1e-5, (1.0 if second else 1e-9) * POWER / 1e-5**2))


CASES = {
    "base": Case(BASE),
    **{f"scale {f:g} by transform": _scale(f, stages.scaled, f in (1e-5, 1e5)) for f in (1e-5, 1e-3, 1e3, 1e5)},
    **{f"scale {f:g} by unit": _scale(f, stages.unit, False) for f in (1e-5, 1e5)},
    **{f"emission {f:g}": _emission(f, f in (1e-5, 1e5)) for f in (1e-5, 1e-2, 1e2, 1e5)},
    "origin 1e4 scene sizes away": Case(BASE, (stages.moved([1e4 * stages.BOX] * 3),), ("base",)),
    "slivers of aspect 1e6": Case(BASE, (stages.slivers(1e6),), ("base",)),
    "base, more seeds": Case(BASE, seeds=SEEDS),
    # Probes beside needles are awake, and share the rays of the others.
    "needle triangles": Case(BASE, (stages.needles(200, 1e-6 * stages.BOX),), ("base, more seeds",), seeds=SEEDS),
    "coincident surfaces": Case(BASE, (stages.doubled,), ("base",)),
    "lamp of 1e-2 of the scene": _bulb(1e-2 * stages.BOX),
    "lamp of 1e-6 of the scene": _bulb(1e-6 * stages.BOX, expected=("lamp of 1e-2 of the scene",), bound=5e-3),
    "wide lamp alone": Case("one_box", _two_lights(True, False), seeds=SEEDS, quick=False),
    "fine lamp alone": Case("one_box", _two_lights(False, True), seeds=SEEDS, quick=False),
    "lamps whose radiances differ by 1e8": Case("one_box", _two_lights(True, True), ("wide lamp alone", "fine lamp alone"), quick=False,
                                                bound=2e-3, hybrid_bound=HYBRID_BIAS, seeds=SEEDS),
    "lamp 1e8 times as bright out of sight": Case("five_boxes", (stages.emission(1e8, "/World/Box1"),), ("one box",), bound=1e-2,
                                                  seeds=3 * SEEDS, quick=False),
    "one box": Case("one_box", seeds=3 * SEEDS, quick=False),
    "mirror": Case("one_box", (stages.metal_ball(0.0),)),
    **{f"roughness {r:g}": Case("one_box", (stages.metal_ball(r),), ("mirror",), bound=5e-3, quick=r == 1e-5)
       for r in (1e-6, 1e-5, 1e-4)},
    **{f"furnace, IOR {ior:g}": Case("", make=lambda path, ior=ior: stages.furnace(path, ior), bound=5e-3,
                                     techniques=("hybrid", "reference", "bpt"), quick=ior in (0.7, 3))
       for ior in (0.7, 1, 1.0001, 1.5, 3)},
}


def plan(bench):
    s = bench.settings
    techniques = s.choose(TECHNIQUES, s.techniques, "--technique")
    names = s.choose([n for n, c in CASES.items() if c.quick or not s.quick], s.stages, "--stage")
    needed = {other for n in names for other in CASES[n].expected}
    return [n for n in CASES if n in names or n in needed], techniques, s.seed


def jobs(bench):
    names, techniques, seed = plan(bench)
    quick, result = bench.settings.quick, {}
    folder = bench.settings.output / "stages"
    folder.mkdir(exist_ok=True)
    for name in names:
        case = CASES[name]
        path = bench.stage(case.source)
        if case.edits or case.make:
            path = folder / (name.replace(" ", "_").replace(",", "") + ".usda")
            case.make(path) if case.make else stages.edited(bench.stage(case.source), path, *case.edits)
        for technique in techniques:
            if technique in case.techniques:
                weight = {"hybrid": 5, "bpt": 2.5, "reference": 2, "restir": 1.2}[technique] * (1 if quick else 2.5)
                for number in range(case.seeds):
                    result[name, technique, number] = Job("average", weight, {
                        "stage": str(path), "technique": technique, "size": SIZE, "spp": 8 if quick else 128,
                        "warmup": 4 if quick else 8, "seed": seed + number})
    if not bench.settings.stages:
        path = folder / "step.usda"
        stages.edited(bench.stage("one_box"), path, stages.emission(0.1),
                      stages.brightened("/World/Box0/Lamp", 4.0, STEP, STEP_FRAMES))
        for technique in RESPONDING:
            if not bench.settings.techniques or technique in techniques:
                result["step", technique, 0] = Job("animation", 3 + 3 * ("ddgi" in technique or technique == "hybrid"), {
                    "stage": str(path), "technique": technique, "size": SIZE, "frames": STEP_FRAMES, "seed": seed})
        frames = 600 if quick else 10_000
        path = folder / "soak.usda"
        stages.soak(bench.stage(BASE), path, SOAK_PERIOD)
        result["soak", SWITCHED, 0] = Job("soak", 5 + 0.025 * frames, {
            "stage": str(path), "size": SOAK_SIZE, "frames": frames, "seed": seed, "options": SOAK_OPTIONS})
    return result


def judge(names, techniques, results):
    """All rows of the table, and the pictures by case and technique."""
    rows, pictures = [], {}

    def pictures_of(name, technique):
        return [results[name, technique, k].arrays["image"] for k in range(CASES[name].seeds)]

    for name in names:
        case = CASES[name]
        for technique in techniques:
            if (name, technique, 0) not in results:
                continue
            images = pictures_of(name, technique)
            rows.append(checks.finite(name, technique, images, sum(
                results[name, technique, k].numbers["nonfinite"] for k in range(case.seeds))))
            expected = [np.full_like(images[0], case.constant)]
            if case.expected:
                parts = zip(*(pictures_of(other, technique) for other in case.expected))
                expected = [case.factor * np.sum(part, axis=0, dtype=np.float64) for part in parts]
            if case.expected or case.make:
                bound = case.hybrid_bound if technique == "hybrid" and case.hybrid_bound else case.bound
                rows.append(checks.ratio(name, technique, images, expected, bound))
                pictures[name, technique] = images[0]
    if ("soak", SWITCHED, 0) in results:
        rows += judge_soak(results["soak", SWITCHED, 0].numbers)
    return rows, pictures


def levels_of(soak):
    """(mean radiance of each loop, {phase: the same}) without the first loop, in which histories begin."""
    phases = {p["name"]: np.array(p["means"])[1:] for p in soak["phases"]}
    return np.average(list(phases.values()), axis=0, weights=[p["frames"] for p in soak["phases"]]), phases


def judge_soak(soak):
    name = f"soak of {soak['frames']} frames"
    whole, phases = levels_of(soak)
    rows = [checks.finite(name, SWITCHED, [], soak["nonfinite"]), checks.drift(name, SWITCHED, whole, 1e-3)]
    # Few loops of few frames tell nothing of a single phase.
    if len(whole) >= 60:
        found = {p: checks.drift(f"{name}, {p}", SWITCHED, means, 1e-3, len(phases)) for p, means in phases.items()
                 if np.ptp(means) > 0}
        worst = [r for r in found.values() if not r.good]
        rows += worst or [max(found.values(), key=lambda r: abs(float(r.measured.split("%")[0])))]
    return [*rows, checks.flat(name, SWITCHED, "device memory", soak["memory_bytes"], 0.0),
            checks.flat(name, SWITCHED, "resident memory", soak["resident_bytes"], 0.01),
            checks.none(name, SWITCHED, "pictures that differ after a reload", soak["changed_after_reload"]),
            checks.none(name, SWITCHED, "pictures that differ in a view of another size",
                        int(np.count_nonzero(np.diff(phases["resized"]))))]


def plot_soak(soak):
    whole, phases = levels_of(soak)
    figure, panels = draw.plt.subplots(1, 3, figsize=(13, 3))
    frames = np.linspace(0, soak["frames"], len(whole) + 1)
    for means in phases.values():
        panels[0].plot(frames[1:], 100 * (means / means.mean() - 1), color="#bbbbbb", linewidth=0.6)
    panels[0].plot(frames[1:], 100 * (whole / whole.mean() - 1), color="black", label="all frames; grey: each phase")
    panels[0].legend(loc="upper left")
    for axes, key in zip(panels[1:], ("memory_bytes", "resident_bytes")):
        axes.plot(frames, np.array(soak[key]) / 1e6, color="black")
        axes.set_ylim(0, 1.2e-6 * max(soak[key]))
    for axes, title in zip(panels, ("mean radiance of a loop against all, %", "device memory, MB", "resident memory, MB")):
        axes.set_title(title, fontsize=9)
        axes.set_xlabel("frame")
    return figure


def report_step(page, results):
    """How soon a light's change shows, and what flickers once all is at rest; as interactive use has it, denoised."""
    found = {t: results["step", t, 0].numbers for t in RESPONDING if ("step", t, 0) in results}
    if not found:
        return {}
    page.heading("A light that changes")
    page.table(("technique", "frames until 90% of the change shows", "flicker at rest, of the mean"),
               [(f"`{t}`", metrics.frames_until(n["means"], STEP - 1), percent(n["flicker"])) for t, n in found.items()])
    figure, axes = draw.plt.subplots(figsize=(7, 3))
    for technique, n in found.items():
        axes.plot(range(1, STEP_FRAMES + 1), n["means"], color=draw.color(technique), label=technique)
    axes.set_xlabel("frame")
    axes.set_ylabel("mean radiance, clipped to 1")
    axes.legend()
    page.plot(figure, "step", f"The lamp of one_box steps to four times its radiance at frame {STEP}; with temporal denoising.")
    return {t: {"frames_until_90%": metrics.frames_until(n["means"], STEP - 1), "flicker": n["flicker"]} for t, n in found.items()}


def report(bench, page, results):
    names, techniques, _ = plan(bench)
    rows, pictures = judge(names, techniques, results)
    failed = [r for r in rows if not r.good]
    page.text(f"{len(rows) - len(failed)} of {len(rows)} checks hold. Pictures of {SIZE[0]} x {SIZE[1]} pixels are compared with those "
              "of the same seed; `+-` is the 95% interval, over blocks of pixels or over seeds, and a comparison whose interval is "
              f"wider than {100 * checks.WIDEST:g}% fails.")
    if failed:
        page.heading("What fails")
        page.table(("case", "technique", "bound", "measured"), [(r.case, f"`{r.technique}`", r.bound, r.measured) for r in failed])
    finite = [r for r in rows if r.bound.startswith("0 values")]
    page.targets([
        ("pixels that are not finite, over all cases", "0", str(sum(int(r.measured) for r in finite)), all(r.good for r in finite)),
        *((r.case, r.bound, r.measured, r.good if r.decided or not r.good else None) for r in rows
          if r.technique == SWITCHED and r not in finite),
    ])
    page.heading("Every case")
    ratios = {(r.case, r.technique): r for r in rows if r.bound.startswith("1")}
    compared = [n for n in names if any((n, t) in ratios for t in techniques)]
    mark = lambda r: "" if r is None else r.measured if r.good else f"**{r.measured}**"
    page.table(("case", "bound", *(f"`{t}`" for t in techniques)),
               [(n, f"1 +- {CASES[n].bound:g}", *(mark(ratios.get((n, t))) for t in techniques)) for n in compared])
    if ("soak", SWITCHED, 0) in results:
        page.plot(plot_soak(results["soak", SWITCHED, 0].numbers), "soak",
                  "One process: a lamp moves, a bulb blinks, a glass ball comes and goes, while nodes, rows and techniques are "
                  "switched, views of another size open and close, and the stage is read again.")
    if pictures:
        page.plot(draw.contact_sheet(techniques, compared, lambda n, t: pictures[n, t] / CASES[n].factor
                                     if (n, t) in pictures else None, width=1.6), "pictures",
                  "The cases' pictures, over their factor.")
    return {"checks": [r.__dict__ for r in rows], "failed": len(failed), "step": report_step(page, results)}
