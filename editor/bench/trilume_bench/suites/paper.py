"""The paper's evaluation: render time, darkening, mean squared error at equal time, caustics; its figures 5 to 12 redrawn.

Every technique renders every scene in one process per repeat: warm-up, then single frames. Techniques take turns within a
scene, so that a busy machine slows all alike.
"""

import math

import numpy as np

from .. import metrics
from .. import report as draw
from ..bench import Job
from ..report import number, percent, percents, within

SCENES = ("cornell_empty", "cornell_big_light", "cornell_glass", "cornell_light_sphere", "one_box", "maze", "white_room")
QUICK_SCENES = ("cornell_glass", "one_box", "maze")
DARK = "five_boxes"  # one_box and four more boxes out of sight: the same picture

# Path tracing as the paper has it: it finds lights by chance alone.
TECHNIQUES = {
    "raytrace": (), "pathtrace": ("--set", "pathtrace.nee=0"), "bpt": (), "restir": (), "ddgi": (), "ddgi_restir": (),
    "restir_bpt": (), "ddgi_restir_bpt": (), "hybrid": (),
}
# Keep nothing from frame to frame: there is nothing to warm up but clocks and caches.
WITHOUT_HISTORY = ("raytrace", "pathtrace", "bpt")
# What the paper compares in figures 7 to 11.
GROUPS = {
    7: ("raytrace", "pathtrace", "bpt"),
    8: ("raytrace", "restir", "restir_bpt"),
    9: ("restir", "ddgi", "ddgi_restir"),
    10: ("ddgi", "ddgi_restir", "ddgi_restir_bpt"),
    11: tuple(name for name in TECHNIQUES if name != "hybrid"),
}
# No division by the probability of the chosen light, which is what darkens in the paper.
UNCOMPENSATED = ("--set", "light.selection=uncompensated")

QUICK_SIZE, SIZE = (96, 54), (320, 180)
# Equal time for each picture, per pixel: one second at 320 x 180.
BUDGET_MS_PER_PIXEL = 1000 / (320 * 180)
# Five boxes against one, to within noise of a few tenths of a percent: frames averaged at a size that costs little. Five boxes
# get five times the probes, so that their spacing is that of one: it has a bias of its own.
FIVE_SIZE, FIVE_SEEDS = (48, 27), 4
FIVE_FRAMES = {"raytrace": 256, "pathtrace": 512, "bpt": 256, "restir": 256, "restir_bpt": 256}
FIVE_FRAMES_WITH_PROBES, FIVE_WARMUP = 128, 64
FIVE_PROBES = ("--set", "ddgi.probes=20480", "--set", "ddgi.budget=163840")
FPS = ((1000 / 30, "30 fps"), (1000 / 60, "60 fps"))
CAUSTIC = ("cornell_glass", (0.38, 0.72, 0.74, 1.0))  # left, top, right, bottom as shares of the picture


def plan(bench):
    """(scenes, techniques, size, repeats) of this run."""
    s = bench.settings
    scenes = s.choose(QUICK_SCENES if s.quick and not s.stages else SCENES, s.stages, "--stage")
    return scenes, s.choose(list(TECHNIQUES), s.techniques, "--technique"), QUICK_SIZE if s.quick else SIZE, s.seeds(1)


def jobs(bench):
    scenes, techniques, size, seeds = plan(bench)
    small = bench.settings.quick
    budget = BUDGET_MS_PER_PIXEL * size[0] * size[1]
    result = {}
    for scene in scenes:
        result["reference", scene] = Job("reference", 1 if small else 45, {"stage": scene, "size": size,
                                                                          "seconds": 5 if small else 40})
    for seed in seeds:
        for scene in (*scenes, *([DARK] if "one_box" in scenes else [])):
            for technique in techniques:
                result[technique, scene, seed] = frames(scene, technique, size, seed, budget, small)
        if "one_box" in scenes:
            for technique in techniques:
                if technique not in ("pathtrace", "hybrid"):
                    result[technique, "uncompensated", seed] = frames(DARK, technique, size, seed, 0, small, UNCOMPENSATED)
    if "one_box" in scenes and not small:
        for technique in techniques:
            probes = technique not in FIVE_FRAMES
            for seed in range(bench.settings.seed, bench.settings.seed + FIVE_SEEDS):
                for scene in ("one_box", DARK):
                    result["five", technique, scene, seed] = Job("average", 8 if probes else 2, {
                        "stage": scene, "technique": technique, "size": FIVE_SIZE, "seed": seed,
                        "spp": FIVE_FRAMES.get(technique, FIVE_FRAMES_WITH_PROBES),
                        "warmup": 2 if technique in WITHOUT_HISTORY else FIVE_WARMUP,
                        "options": FIVE_PROBES if probes and scene == DARK else ()})
    return result


def five_boxes(results, techniques):
    """{technique: (mean of five boxes over that of one - 1, half width of its interval over seeds)} of a full run."""
    def mean(technique, scene, seed):
        return results["five", technique, scene, seed].arrays["image"].mean(dtype=np.float64)

    seeds = sorted({key[3] for key in results if key[0] == "five"})
    return {t: metrics.interval([mean(t, DARK, s) / mean(t, "one_box", s) - 1 for s in seeds]) for t in techniques} if seeds else {}


def frames(scene, technique, size, seed, budget, small, options=()):
    warmup = 2 if technique in WITHOUT_HISTORY else 6 if small else 16
    weight = {"raytrace": 1, "pathtrace": 1.3, "restir": 1.2, "ddgi": 4, "ddgi_restir": 4.5, "bpt": 4, "hybrid": 6,
              "restir_bpt": 5, "ddgi_restir_bpt": 9}[technique] * (1 if small else 2.5)
    return Job("frames", weight, {"stage": scene, "technique": technique, "size": size, "warmup": warmup,
                                  "count": 4 if small else 8, "seed": seed, "budget_ms": budget,
                                  "options": [*TECHNIQUES[technique], *options]})


class Measured:
    """Numbers of a run by technique and scene: medians over repeats."""

    def __init__(self, bench, results):
        self.scenes, self.techniques, self.size, self.seeds = plan(bench)
        self.results = results

    def reference(self, scene):
        return self.results["reference", "one_box" if scene == DARK else scene].arrays["image"]

    def over_seeds(self, technique, scene, value):
        return [value(self.results[technique, scene, seed]) for seed in self.seeds]

    def table(self, value):
        """{technique: {scene: median of value(result, reference)}}."""
        return {t: {s: float(np.median(self.over_seeds(t, s, lambda r: value(r, self.reference(s))))) for s in self.scenes}
                for t in self.techniques}

    def image(self, technique, scene, kind="equal"):
        return self.results[technique, scene, self.seeds[0]].arrays[kind]


def darkening(m):
    """{technique: (paper's measure, ratio of means, ratio of means uncompensated or None)}, medians over repeats."""
    def against_one(t, what, measure):
        return float(np.median([metrics.darkening(m.results[t, what, s].arrays["mean"], m.results[t, "one_box", s].arrays["mean"])
                                [measure] for s in m.seeds]))

    return {t: (against_one(t, DARK, 0), against_one(t, DARK, 1),
                against_one(t, "uncompensated", 1) if (t, "uncompensated", m.seeds[0]) in m.results else None)
            for t in m.techniques}


def report_darkening(page, values):
    series = {"as the paper computes it": 0, "ratio of means": 1, "uncompensated, ratio of means": 2}
    figure, axes = draw.plt.subplots(figsize=(8, 3.2))
    for index, (name, column) in enumerate(series.items()):
        heights = [100 * v[column] if v[column] is not None else np.nan for v in values.values()]
        axes.bar(np.arange(len(values)) + (index - 1) * 0.27, heights, 0.27, label=name,
                 color=("#88ccee", "#332288", "#cc6677")[index])
    axes.axhline(100, color="black", linewidth=0.8)
    axes.set_xticks(range(len(values)), values, rotation=20)
    axes.set_ylabel("brightness kept, %")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(0, 1.0))
    page.heading("Darkening (figure 6)")
    page.plot(figure, "figure06_darkening", "Brightness of one box when four more, each with its lamp, stand out of sight. 100% is "
              "right; uncompensated leaves out the division by the probability of the chosen lamp, as the paper's systems did.")
    page.table(("technique", "paper's measure", "ratio of means", "uncompensated, ratio of means"),
               [(f"`{t}`", *(percent(x) if x is not None else "" for x in v)) for t, v in values.items()])


def report_caustic(page, m):
    """Figure 12: the glass box and crops of its caustic."""
    scene, (left, top, right, bottom) = CAUSTIC
    if scene not in m.scenes:
        return
    width, height = m.size

    def crop(image):
        return image[int(top * height):int(bottom * height), int(left * width):int(right * width)]

    columns = ("reference", *m.techniques)

    def cell(row, column):
        image = m.reference(scene) if column == "reference" else m.image(column, scene)
        return image if row == "picture" else crop(image)

    page.heading("Caustics (figure 12)")
    page.plot(draw.contact_sheet(columns, ("picture", "caustic"), cell, width=1.7), "figure12_caustic",
              "The glass box at equal time, not denoised, and the floor below the sphere.")
    whole = crop(m.reference(scene)).mean()
    page.table(("technique", "mean of the crop against the reference's", "MSE of the crop"),
               [(f"`{t}`", percent(crop(m.image(t, scene)).mean() / whole, 1),
                 number(metrics.display_mse(crop(m.image(t, scene)), crop(m.reference(scene))))) for t in m.techniques])


def geometric_mean(values):
    return math.exp(np.mean(np.log(list(values))))


def summary_row(m, t, times, errors, relative, ratios):
    averaged = [m.results[t, s, seed].numbers["averaged"] for s in m.scenes for seed in m.seeds]
    against = "hybrid" if "hybrid" in m.techniques else t
    return (f"`{t}`", f"{number(min(times[t].values()))} to {number(max(times[t].values()))}",
            f"{min(averaged)} to {max(averaged)}",
            number(geometric_mean(errors[t][s] / errors[against][s] for s in m.scenes)),
            number(geometric_mean(relative[t].values())),
            f"{percent(min(ratios[t].values()), 1)} to {percent(max(ratios[t].values()), 1)}")


def targets(m, times, errors, relative, dark):
    """Rows of the targets that this suite measures."""
    rows = []
    if "hybrid" in m.techniques:
        for other in ("ddgi_restir_bpt", "pathtrace", "bpt"):
            if other in m.techniques:
                for name, error in (("MSE", errors), ("relMSE", relative)):
                    shares = {s: error["hybrid"][s] / error[other][s] for s in m.scenes}
                    worst = max(shares, key=shares.get)
                    rows.append((f"{name} of `hybrid` over that of `{other}` at equal time, each scene", "at most 0.25",
                                 f"{number(min(shares.values()))} to {number(shares[worst])} ({worst})",
                                 shares[worst] <= 0.25))
        if "raytrace" in m.techniques:
            slower = [times["hybrid"][s] / times["raytrace"][s] for s in m.scenes]
            rows.append(("time of a `hybrid` frame over that of a `raytrace` frame", "at most 1.5",
                         f"{number(min(slower))} to {number(max(slower))}", max(slower) <= 1.5))
        found = {s: metrics.bias(m.image("hybrid", s, "mean"), m.reference(s)) for s in m.scenes}
        rows.append(("signed bias of `hybrid`, worst scene", "within 1%", *draw.worst(found, 0.01)))
        slowest = max(times["hybrid"].values())
        met = slowest <= 1000 / 30 if m.size == SIZE else None
        rows.append((f"`hybrid` at 320 x 180: slowest scene (measured at {m.size[0]} x {m.size[1]})", "30 frames a second",
                     f"{number(1000 / slowest)} frames a second", met))
    five = five_boxes(m.results, m.techniques)
    if five:
        rows += [(f"five boxes against one, `{t}`", "100% +- 0.5%", percents(found), within(found, 0.005)) for t, found in five.items()]
    elif dark:
        found = {t: metrics.bias(m.image(t, DARK, "mean"), m.image(t, "one_box", "mean")) for t in m.techniques}
        rows.append(("five boxes against one, worst technique", "100% +- 0.5%", *draw.worst(found, 0.005)))
    return rows


def report_figures(page, m, times, errors):
    width, height = m.size
    page.heading("Render time (figure 5)")
    page.plot(draw.lines_by_group(m.scenes, m.techniques, times, f"ms a frame at {width} x {height}", FPS), "figure05_time",
              "Median time of a frame after warm-up, one sample a pixel.")
    page.table(("ms a frame", *m.scenes), [(f"`{t}`", *(number(times[t][s]) for s in m.scenes)) for t in m.techniques])
    page.heading("Error at equal time (figures 7 to 11)")
    page.text("Mean squared error of linear radiance, clipped to [0, 1] as in a picture, over pixels and channels; `hybrid` beside "
              "each of the paper's groups.")
    for figure, group in GROUPS.items():
        names = [t for t in (*group, "hybrid") if t in m.techniques]
        if names:
            page.plot(draw.grouped_bars(m.scenes, names, errors, "MSE", log=True), f"figure{figure:02d}_mse",
                      f"Figure {figure}: {', '.join(names)}.")
    page.table(("MSE", *m.scenes), [(f"`{t}`", *(number(errors[t][s]) for s in m.scenes)) for t in m.techniques])


def report(bench, page, results):
    """Writes the page; returns the summary for results.json."""
    m = Measured(bench, results)
    times = m.table(lambda r, _: r.numbers["frame_ms"])
    errors = m.table(lambda r, reference: metrics.display_mse(r.arrays["equal"], reference))
    relative = m.table(lambda r, reference: metrics.relmse(r.arrays["equal"], reference))
    ratios = m.table(lambda r, reference: metrics.mean_ratio(r.arrays["mean"], reference))
    bad = sum(r.numbers.get("nonfinite", 0) for r in results.values())

    page.text(f"{m.size[0]} x {m.size[1]} pixels, not denoised. Equal time: each picture is the mean of as many frames after "
              f"warm-up as fill {BUDGET_MS_PER_PIXEL * m.size[0] * m.size[1]:.0f} ms, at least one. References: "
              f"{', '.join(sorted({results['reference', s].numbers['source'] for s in m.scenes}))}.")
    page.table(("technique", "ms a frame", "frames in equal time", "MSE, times that of `hybrid`", "relMSE",
                "mean against the reference"),
               [summary_row(m, t, times, errors, relative, ratios) for t in m.techniques])
    page.plot(draw.contact_sheet(("reference", *m.techniques), m.scenes,
                                 lambda s, t: m.reference(s) if t == "reference" else m.image(t, s), width=1.7),
              "pictures", "Every technique at equal time, not denoised, plain sRGB.")
    dark = darkening(m) if "one_box" in m.scenes else {}
    page.targets([*targets(m, times, errors, relative, dark), ("pixels that are not finite", "0", str(bad), bad == 0)])
    report_figures(page, m, times, errors)
    if dark:
        report_darkening(page, dark)
    report_caustic(page, m)
    unclipped = m.table(lambda r, reference: metrics.mse(r.arrays["equal"], reference))
    return {"frame_ms": times, "mse_unclipped": unclipped, "mse_equal_time": errors, "relmse_equal_time": relative, "mean_ratio": ratios,
            "darkening": dark, "nonfinite": bad}
