"""Cost of a frame against the number of lights, instances, triangles, pixels and probes, one of them growing at a time."""

import numpy as np

from .. import report as draw
from .. import rival, stages
from ..bench import Job
from ..report import number

TECHNIQUES = ("raytrace", "restir", "hybrid")
SIZE = (160, 90)
# axis: numbers of a quick run, and those that a full one adds.
AXES = {
    "lights": ((1, 30, 1000), (10, 100, 10_000, 100_000)),
    "instances": ((1, 100, 10_000), (10, 1000, 100_000)),
    "triangles": ((100, 10_000, 300_000), (1000, 100_000, 1_000_000)),
    "pixels": ((96 * 54, 320 * 180), (192 * 108, 640 * 360)),
    "probes": ((512, 4096), (1024, 2048, 16_384)),
}
RIVAL = "rival"


def plan(bench):
    s = bench.settings
    chosen = s.choose((*AXES, RIVAL), s.stages, "--stage")
    return ({axis: sorted(AXES[axis][0] + (() if s.quick else AXES[axis][1])) for axis in AXES if axis in chosen},
            s.choose(TECHNIQUES if not s.quick or s.techniques else ("raytrace", "hybrid"), s.techniques, "--technique"), RIVAL in chosen)


def jobs(bench):
    axes, techniques, against_rival = plan(bench)
    folder = bench.settings.output / "stages"
    folder.mkdir(exist_ok=True)
    result = {}
    for axis, counts in axes.items():
        for count in counts:
            parts = {{"lights": "lamps"}.get(axis, axis): count} if axis in ("lights", "instances", "triangles") else {}
            path = folder / (f"{axis}_{count}.usda" if parts else "hall.usda")
            if not path.exists():
                stages.hall(path, **parts)
            size = (round((count * 16 / 9) ** 0.5), round((count * 9 / 16) ** 0.5)) if axis == "pixels" else SIZE
            for technique in techniques:
                if axis == "probes" and technique != "hybrid":
                    continue
                options = ["--set", f"ddgi.probes={count}"] if axis == "probes" else []
                result[axis, count, technique] = Job("frames", {"raytrace": 1, "restir": 1.2, "hybrid": 5}[technique] +
                                                     (20 if count > 50_000 and axis == "lights" else 0), {
                    "stage": str(path), "technique": technique, "size": size, "warmup": 4, "count": 4 if bench.settings.quick else 9,
                    "seed": bench.settings.seed, "options": options})
    return {**result, **(rival.jobs(bench) if against_rival else {})}


def plot(axes, techniques, results):
    """The figure, and points by axis and technique."""
    figure, panels = draw.plt.subplots(1, len(axes), figsize=(3.2 * len(axes), 3), squeeze=False, sharey=True)
    points = {}
    for panel, (axis, counts) in zip(panels[0], axes.items()):
        for technique in techniques:
            found = [(c, results[axis, c, technique].numbers["frame_ms"]) for c in counts if (axis, c, technique) in results]
            if found:
                panel.plot(*np.transpose(found), marker="o", markersize=4, color=draw.color(technique), label=technique)
                points[f"{axis} {technique}"] = found
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlabel(axis)
        panel.xaxis.set_minor_formatter(draw.plt.NullFormatter())
        if counts[-1] < 100 * counts[0]:
            panel.set_xticks(counts, counts)
    panels[0][0].set_ylabel("ms a frame")
    panels[0][0].legend()
    return figure, points


def report(bench, page, results):
    axes, techniques, against_rival = plan(bench)
    page.text(f"Median time of a frame after warm-up, {SIZE[0]} x {SIZE[1]} pixels unless pixels grow; total power and covered area "
              "are held while numbers grow.")
    summary, bad = {}, sum(r.numbers.get("nonfinite", 0) for r in results.values())
    if axes:
        figure, summary = plot(axes, techniques, results)
        page.plot(figure, "scale", "Cost of a frame.")
    rows = [("pixels that are not finite", "0", str(bad), bad == 0)]
    for name, points in summary.items():
        axis, (least, first), (most, last) = name.split()[0], points[0], points[-1]
        if axis in ("lights", "instances"):
            limit = 1 + np.log2(most / least)
            rows.append((f"{name}: {most} against {least}", f"logarithm, at most {number(limit)} times the time",
                         f"{number(last / first)} times", last / first <= limit))
        if axis == "pixels":
            growth = last / first / (most / least)
            rows.append((f"{name}: {most} against {least}", "linear: at most 1.2 times the time a pixel", f"{number(growth)} times",
                         growth <= 1.2))
    pictures = None
    if against_rival:
        more, pictures, found = rival.targets(results)
        rows += more
    page.targets(rows)
    if pictures:
        rival.show(page, pictures)
    for axis, counts in axes.items():
        page.heading(axis)
        rows = []
        for count in counts:
            for technique in techniques:
                if (axis, count, technique) in results:
                    n = results[axis, count, technique].numbers
                    rows.append((count, f"`{technique}`", number(n["frame_ms"]), number(n["startup_ms"]["load"]),
                                 f"{n['memory_bytes'] / 1e6:.1f}",
                                 ", ".join(f"{name} {number(ms)}" for name, ms in n["nodes"].items() if ms > 0.05)))
        page.table((axis, "technique", "ms a frame", "ms to load", "MB on the device", "ms by node"), rows)
    return {**summary, **({RIVAL: found} if against_rival else {})}
