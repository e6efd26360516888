"""Error against time, per technique and scene: what a picture costs, from a single frame to a long average.

Time is that of the averaged frames after warm-up. Bands are 95% intervals from resampled blocks of pixels. Mitsuba 3 and Cycles
render the same stages on the same cores in the same run where they are installed.
"""

import math
from dataclasses import dataclass

import numpy as np

from .. import metrics
from .. import report as draw
from ..bench import Job
from ..report import number, percent, percents

CLASSES = ("direct", "caustic", "indirect", "emission")
FIRST = ("direct", "emission")


@dataclass(frozen=True)
class Way:
    technique: str
    options: tuple = ()
    warmup: int = 16        # frames
    start: int = 12         # single frames at the start of the curve
    unbiased: bool = False
    classes: tuple = CLASSES


TECHNIQUES = {
    "raytrace": Way("raytrace", warmup=2, start=32, classes=FIRST),
    "restir": Way("restir", start=32, classes=FIRST),
    "pathtrace": Way("pathtrace", warmup=2, start=32, unbiased=True),
    "bpt": Way("bpt", warmup=2, unbiased=True),
    "restir_bpt": Way("restir_bpt", unbiased=True),
    "ddgi_restir": Way("ddgi_restir", classes=(*FIRST, "indirect")),
    "ddgi_restir_bpt": Way("ddgi_restir_bpt"),
    "hybrid": Way("hybrid"),
    "hybrid_final": Way("hybrid", ("--set", "ddgi.gather=final")),
}
QUICK = ("raytrace", "pathtrace", "bpt", "ddgi_restir_bpt", "hybrid")
SCENES, QUICK_SCENES = ("cornell_glass", "maze", "white_room"), ("cornell_glass", "maze")
LONGEST = "cornell_glass"  # whose unbiased curves go on to 100 s
SIZE = (96, 54)            # of the references by an independent renderer
# Error against samples at a size where three decades of them take seconds: whether of direct light alone, and from how many
# samples on. Frames that share reservoirs depend on each other over as many.
FALLING = {"pathtrace": (False, 1), "bpt": (False, 1), "restir_bpt": (False, 16), "restir": (True, 16)}
FALLING_STAGES, QUICK_FALLING_STAGES = ("one_box", "maze"), ("one_box",)
FALLING_SIZE, FALLING_WARMUP = (32, 18), 16
OFFLINE = ("mitsuba", "cycles")  # where they are installed
EQUAL_TIMES = (0.1, 1.0)   # seconds


def plan(bench):
    s = bench.settings
    scenes = s.choose(QUICK_SCENES if s.quick and not s.stages else SCENES, s.stages, "--stage")
    names = s.choose(QUICK if s.quick and not s.techniques else list(TECHNIQUES), s.techniques, "--technique")
    return scenes, names, s.seeds(1)


def falling_jobs(bench):
    quick, s = bench.settings.quick, bench.settings
    if s.stages:
        return {}
    return {("falling", stage, technique): Job("convergence", 12 if quick else 75, {
        "stage": stage, "technique": technique, "size": FALLING_SIZE, "warmup": FALLING_WARMUP, "count": 256 if quick else 2048,
        "seconds": 1 if quick else 6, "seeds": list(range(s.seed, s.seed + (3 if quick else 5))), "direct": direct})
        for stage in (QUICK_FALLING_STAGES if quick else FALLING_STAGES) for technique, (direct, _) in FALLING.items()
        if not s.techniques or technique in s.techniques}


def exponents(results):
    """{(stage, technique): (exponent of relMSE over samples, half width of its interval over runs, decades)}."""
    found = {}
    for key, result in results.items():
        if key[0] == "falling":
            n, first = result.numbers, result.numbers["spp"].index(FALLING[key[2]][1])
            found[key[1:]] = (*metrics.interval([metrics.slope(n["spp"][first:], run[first:]) for run in n["relmse"]]),
                              math.log10(n["spp"][-1] / n["spp"][first]))
    return found


def exponent_row(found):
    """Of the target table."""
    (stage, technique), (mean, width, decades) = max(found.items(), key=lambda item: abs(item[1][0] + 1))
    decided = decades >= 2 and width <= 0.05
    good = abs(mean + 1) <= 0.05 + width if decided else None
    return ("relMSE over samples: exponent of the unbiased techniques", "-1 +- 0.05 over 3 decades",
            f"{mean:.3f} +- {width:.2g} over {decades:.1f} decades (`{technique}`, {stage}), farthest of {len(found)}", good)


def report_falling(page, results):
    found = exponents(results)
    if not found:
        return {}
    names = sorted({stage for stage, _ in found})
    figure, panels = draw.plt.subplots(1, len(names), figsize=(5 * len(names), 3.4), squeeze=False, sharey=True)
    for axes, stage in zip(panels[0], names):
        for technique in (t for t in FALLING if (stage, t) in found):
            n = results["falling", stage, technique].numbers
            axes.plot(n["spp"], np.mean(n["relmse"], axis=0), marker=".", markersize=4, color=draw.color(technique), label=technique)
        highest = max(np.mean(n["relmse"], axis=0)[0] for (s, t) in found if s == stage for n in [results["falling", s, t].numbers])
        axes.plot(n["spp"], 2 * highest / np.array(n["spp"]), color="#cc3311", linestyle="--", linewidth=1, label="1 / samples")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("samples a pixel")
        axes.set_title(stage, fontsize=9)
    panels[0][0].set_ylabel("relMSE")
    panels[0][0].legend()
    page.heading("Error against samples")
    width, height = FALLING_SIZE
    page.text(f"Means of single frames at {width} x {height}, against two independent long runs of `reference`, in whose product of "
              "differences their own noise drops out. `restir` against direct light, and from 16 samples on, as `restir_bpt`: their "
              "frames share reservoirs.")
    page.plot(figure, "falling", "Unbiased: parallel to the dashed line.")
    page.table(("technique", "stage", "exponent", "decades"),
               [(f"`{t}`", s, f"{mean:.3f} +- {width:.2g}", f"{decades:.1f}") for (s, t), (mean, width, decades) in found.items()])
    return {f"{t} {s}": values for (s, t), values in found.items()}


def jobs(bench):
    scenes, names, seeds = plan(bench)
    quick, result = bench.settings.quick, falling_jobs(bench)
    for scene in scenes:
        result["reference", scene] = Job("reference", 0.1, {"stage": scene, "size": SIZE, "seconds": 10})
        result["classes", scene] = Job("reference", 9 if quick else 34, {
            "stage": scene, "size": SIZE, "seconds": 6 if quick else 30, "aovs": CLASSES})
    for seed in seeds:
        for scene in scenes:
            for name in names:
                way = TECHNIQUES[name]
                seconds = [1] if quick else [1, 4, 16, 100] if scene == LONGEST and way.unbiased else [1, 4, 16]
                startup = 12 if "ddgi" in way.technique or way.technique == "hybrid" else 4
                result[name, scene, seed] = Job("curve", startup * (1 + 0.3 * len(seconds)) + sum(seconds), {
                    "stage": scene, "technique": way.technique, "size": SIZE, "warmup": min(way.warmup, 6) if quick else way.warmup,
                    "count": way.start, "seconds": seconds, "seed": seed, "options": way.options, "aovs": way.classes})
            for renderer in OFFLINE:
                result[renderer, scene, seed] = Job("offline", 6 if quick else 25, {
                    "stage": scene, "size": SIZE, "seconds": 1 if quick else 4, "seed": seed, "renderer": renderer})
    return result


class Curve:
    """Errors of one run's growing averages."""

    def __init__(self, result, reference):
        images = result.arrays["images"]
        self.seconds = np.array(result.numbers["ms"]) / 1e3
        self.spp = np.array(result.numbers["spp"])
        self.relmse = np.array([metrics.bootstrap(metrics.relative_squared_errors(i, reference)) for i in images])
        self.mse = np.array([metrics.bootstrap(metrics.squared_errors(i, reference)) for i in images])
        self.flip = [metrics.flip(i, reference) for i in images]
        self.ratio = metrics.mean_ratio(images[-1], reference)

    def at(self, seconds):
        """relMSE at a time, along straight lines of the log-log plot; None before the first picture is there."""
        order = np.argsort(self.seconds)
        times, errors = self.seconds[order], self.relmse[order, 0]
        if not times[0] <= seconds * 1.05 or seconds > 1.5 * times[-1]:
            return None
        return float(np.exp(np.interp(math.log(seconds), np.log(times), np.log(errors))))


def plot(curves, scene, names):
    figure, panels = draw.plt.subplots(1, 3, figsize=(13, 4))
    for name in names:
        for curve in curves[name, scene]:
            order = np.argsort(curve.seconds)
            for axes, values in zip(panels, (curve.relmse, curve.mse)):
                axes.fill_between(curve.seconds[order], values[order, 1], values[order, 2], color=draw.color(name), alpha=0.15,
                                  linewidth=0)
                axes.plot(curve.seconds[order], values[order, 0], marker=".", markersize=4, color=draw.color(name), label=name,
                          linewidth=2 if name == "hybrid" else 1.3)
            if curve.flip[0] is not None:
                panels[2].plot(curve.seconds[order], np.array(curve.flip)[order], marker=".", markersize=4,
                               color=draw.color(name), linewidth=2 if name == "hybrid" else 1.3)
    for axes, label in zip(panels, ("relMSE", "MSE", "HDR-FLIP")):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("seconds")
        axes.set_title(label, fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    known = dict(zip(labels, handles))
    figure.legend(known.values(), known.keys(), ncols=len(known), loc="lower center", bbox_to_anchor=(0.5, -0.12))
    return figure


def bias_rows(results, scenes, names, seeds, references):
    """Signed bias of the longest run: overall against the stored reference, per path class against `reference`."""
    for name in names:
        for scene in scenes:
            result = results[name, scene, seeds[0]]
            classes = metrics.class_bias(result.arrays, results["classes", scene].arrays)
            yield name, scene, metrics.bias(result.arrays["images"][-1], references[scene]), classes


def targets(curves, biases, results, scenes, names, offline):
    rows = []
    overall = {n: {s: found for other, s, found, _ in biases if other == n} for n in names}
    for name in names:
        if not TECHNIQUES[name].unbiased:
            continue
        rows.append((f"`{name}` mean against the independent reference", "within 0.2%", *draw.worst(overall[name], 0.002)))
    for name, bound in (("hybrid", 0.01), ("hybrid_final", 0.005)):
        if name in names:
            rows.append((f"`{name}` signed bias, overall", f"within {percent(bound, 1)}", *draw.worst(overall[name], bound)))
            classes = {f"{c}, {scene}": found for other, scene, _, by_class in biases if other == name
                       for c, found in by_class.items()}
            rows.append((f"`{name}` signed bias, per path class", "within 3%", *draw.worst(classes, 0.03)))
    for renderer in offline if "hybrid" in names else ():
        for seconds in EQUAL_TIMES:
            pairs = [(curves["hybrid", s][0].at(seconds), curves[renderer, s][0].at(seconds), s) for s in scenes]
            known = [(a / b, s) for a, b, s in pairs if a and b]
            if known:
                worst = max(known)
                rows.append((f"relMSE of `hybrid` over that of {renderer.capitalize()} at {seconds:g} s", "below 1",
                             f"{number(min(known)[0])} to {number(worst[0])} ({worst[1]})", worst[0] < 1))
    return rows


def report(bench, page, results):
    scenes, names, seeds = plan(bench)
    references = {s: results["reference", s].arrays["image"] for s in scenes}
    offline = [r for r in OFFLINE if all(results[r, s, seeds[0]].numbers["installed"] for s in scenes)]
    shown = [*names, *offline]
    curves = {(n, s): [Curve(results[n, s, seed], references[s]) for seed in seeds] for n in shown for s in scenes}
    biases = list(bias_rows(results, scenes, names, seeds, references))
    bad = sum(r.numbers.get("nonfinite", 0) for r in results.values())

    others = "; ".join(results[r, scenes[0], seeds[0]].numbers["renderer"] for r in offline)
    page.text(f"{SIZE[0]} x {SIZE[1]} pixels, not denoised, against "
              f"{', '.join(sorted({results['reference', s].numbers['source'] for s in scenes}))}. Time is that of the averaged frames "
              "after warm-up. " + (f"On the same cores, loading and compiling left out: {others}." if offline else
                                   "Neither Mitsuba nor Cycles is installed."))
    page.targets([*targets(curves, biases, results, scenes, names, offline),
                  *([exponent_row(falling)] if (falling := exponents(results)) else []),
                  ("pixels that are not finite", "0", str(bad), bad == 0)])
    for scene in scenes:
        page.heading(scene)
        page.plot(plot(curves, scene, shown), f"pareto_{scene}", "Error against time, with 95% bands.")
        page.table(("technique", "ms a frame", *(f"relMSE at {t:g} s" for t in EQUAL_TIMES), "longest", "its relMSE", "its FLIP"),
                   [(f"`{n}`", number(results[n, scene, seeds[0]].numbers.get("frame_ms")),
                     *(number(curves[n, scene][0].at(t)) for t in EQUAL_TIMES), f"{curves[n, scene][0].seconds.max():.3g} s",
                     number(curves[n, scene][0].relmse[-1, 0]), number(curves[n, scene][0].flip[-1])) for n in shown])
    page.plot(draw.contact_sheet(("reference", *shown), scenes, lambda s, n: references[s] if n == "reference" else
                                 results[n, s, seeds[0]].arrays["images"][-1], width=1.7), "pictures", "Each longest average.")
    page.heading("Signed bias of the longest average")
    page.text("Overall against the reference; per path class against a long run of `reference`. Empty: the scene has no such "
              "light.")
    page.table(("technique", "scene", "overall", *CLASSES),
               [(f"`{n}`", s, percents(all_), *(percents(c[k]) if k in c else "" for k in CLASSES)) for n, s, all_, c in biases])
    return {"exponents": report_falling(page, results), "curves": {f"{n} {s}": [{"seconds": c.seconds.tolist(), "spp": c.spp.tolist(), "relmse": c.relmse.tolist(),
                                     "mse": c.mse.tolist(), "flip": c.flip} for c in curves[n, s]] for n, s in curves},
            "bias": [{"technique": n, "scene": s, "overall": all_, **c} for n, s, all_, c in biases], "nonfinite": bad}
