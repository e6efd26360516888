"""Rays per second: our own BVH in a compute kernel, the driver's ray queries, and Embree's single-ray functions with the same
threads, rays and triangles."""

from .. import report as draw
from ..bench import Job
from ..report import number

SCENES = ("10", "7k", "180k", "1M")  # triangles, as tests/bench/tracer names them
QUICK_SCENES = ("10", "7k", "180k")
TRACERS = ("compute", "query", "embree")
COLORS = {"compute": "#000000", "query": "#cc6677", "embree": "#88ccee"}


def plan(bench):
    s = bench.settings
    return s.choose(QUICK_SCENES if s.quick and not s.stages else SCENES, s.stages, "--stage")


def jobs(bench):
    quick = bench.settings.quick
    return {scene: Job("tracer", {"10": 3, "7k": 8, "180k": 15, "1M": 30}[scene] * (1 if quick else 4), {
        "scene": SCENES.index(scene), "rays": 1 << (16 if quick else 19),
        "repeats": bench.settings.repeats or (3 if quick else 7)}) for scene in plan(bench)}


def report(bench, page, results):
    scenes = plan(bench)
    rows = [row for scene in scenes for row in results[scene].numbers["results"]]
    rates, builds = [r for r in rows if "rays" in r], [r for r in rows if "buildMs" in r]
    page.text("Million rays per second, medians of repeats interleaved between the tracers.")

    def share(row, other):
        return row["compute"] / row[other] if other in row else None

    hard = [r for r in rates if r["scene"] == "180k" and r["rays"] == "incoherent"]
    against = lambda other: share(hard[0], other) if hard else None
    page.targets([
        ("`compute` over Embree, incoherent, 180,000 triangles", "at least 0.5", number(against("embree")),
         None if not hard else against("embree") >= 0.5),
        ("`compute` over the driver's ray queries, the same", "at least 3", number(against("query")),
         None if against("query") is None else against("query") >= 3)])
    figure, panels = draw.plt.subplots(1, 3, figsize=(12, 3.2), sharey=True)
    for axes, kind in zip(panels, ("coherent", "incoherent", "shadow")):
        chosen = [r for r in rates if r["rays"] == kind]
        for index, tracer in enumerate(TRACERS):
            axes.bar([x + (index - 1) * 0.27 for x in range(len(chosen))], [r.get(tracer, 0) for r in chosen], 0.27, label=tracer,
                     color=COLORS[tracer])
        axes.set_xticks(range(len(chosen)), [r["scene"] for r in chosen])
        axes.set_title(kind, fontsize=9)
        axes.set_xlabel("triangles")
        axes.set_yscale("log")
    panels[0].set_ylabel("million rays a second")
    panels[0].set_ylim(bottom=0.5 * min(r[t] for r in rates for t in TRACERS if t in r))
    panels[0].legend(ncols=len(TRACERS), loc="lower left", bbox_to_anchor=(0, 1.08))
    page.plot(figure, "rates", "Single rays, all threads.")
    page.table(("triangles", "rays", *TRACERS, "compute / embree", "compute / query"),
               [(r["triangles"], r["rays"], *(number(r.get(t)) for t in TRACERS), number(share(r, "embree")),
                 number(share(r, "query"))) for r in rates])
    page.heading("Building")
    page.table(("triangles", "ms", "Embree, ms", "expected cost", "depth"),
               [(r["triangles"], number(r["buildMs"]), number(r["embreeBuildMs"]), number(r["cost"]), r["depth"]) for r in builds])
    return {"rates": rates, "builds": builds}
