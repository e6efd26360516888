"""Start-up: device, loading, pipelines and the first frame, with empty caches and with what they hold after one run; and
what each kernel takes to compile."""

from .. import report as draw
from ..bench import Job
from ..report import number

PHASES = ("device", "load", "pipelines", "first_frame", "process")
TECHNIQUES, QUICK = ("raytrace", "pathtrace", "bpt", "restir", "ddgi_restir", "ddgi_restir_bpt", "hybrid"), ("raytrace", "hybrid")
STAGES, QUICK_STAGES = ("cornell_empty", "cornell_glass", "maze", "white_room"), ("cornell_empty", "cornell_glass")
SIZE = (320, 180)
KERNEL_PHASES = ("spirv_ms", "driver_ms", "dispatch_ms")


def plan(bench):
    s = bench.settings
    return (s.choose(QUICK_STAGES if s.quick and not s.stages else STAGES, s.stages, "--stage"),
            s.choose(QUICK if s.quick and not s.techniques else TECHNIQUES, s.techniques, "--technique"))


def jobs(bench):
    stages, techniques = plan(bench)
    runs = bench.settings.repeats or (2 if bench.settings.quick else 5)
    return {(t, s): Job("startup", (1 + 4 * ("ddgi" in t or t == "hybrid")) * (2 + runs), {
        "stage": s, "technique": t, "size": SIZE, "runs": runs, "seed": bench.settings.seed}) for s in stages for t in techniques}


def plot(results, stages, techniques):
    figure, panels = draw.plt.subplots(1, 2, figsize=(12, 3.5), sharey=True)
    names = [f"{s}\n{t}" for s in stages for t in techniques]
    for axes, state in zip(panels, ("cold", "warm")):
        bottom = [0.0] * len(names)
        for phase, color in zip(("device", "load", "pipelines", "the rest"), ("#332288", "#88ccee", "#ddcc77", "#cc6677")):
            times = [results[t, s].numbers[state] for s in stages for t in techniques]
            heights = [n["first_frame"] - n["device"] - n["load"] - n["pipelines"] if phase == "the rest" else n[phase]
                       for n in times]
            axes.bar(names, heights, bottom=bottom, label=phase, color=color)
            bottom = [b + h for b, h in zip(bottom, heights)]
        axes.set_title(f"{state} caches", fontsize=9)
        axes.tick_params(axis="x", labelrotation=90, labelsize=7)
    panels[0].set_ylabel("ms until the first frame")
    panels[0].legend()
    return figure


def report(bench, page, results):
    stages, techniques = plan(bench)
    page.text(f"{SIZE[0]} x {SIZE[1]} pixels. Cold: an empty cache folder, so that shaders are compiled by us and by the driver. "
              "Warm: medians of runs that find what the first left. `process` is the whole command, with writing.")
    rows = []
    for state, limit in (("warm", 1.0), ("cold", 10.0)):
        if "hybrid" in techniques:
            seconds = {s: results["hybrid", s].numbers[state]["first_frame"] / 1e3 for s in stages}
            worst = max(seconds, key=seconds.get)
            rows.append((f"first frame of `hybrid`, {state} caches", f"within {limit:g} s after start",
                         f"{number(min(seconds.values()))} to {number(seconds[worst])} s ({worst})", seconds[worst] <= limit))
    page.targets(rows)
    page.plot(plot(results, stages, techniques), "startup", "Until the first frame is there.")
    for state in ("cold", "warm"):
        page.heading(f"{state.capitalize()} caches, ms")
        page.table(("stage", "technique", *PHASES),
                   [(s, f"`{t}`", *(number(results[t, s].numbers[state][p]) for p in PHASES)) for s in stages for t in techniques])
    page.heading("Kernels, cold caches, ms")
    page.text("Of the technique named last. SPIR-V: our compiler. Driver: its front end, which on lavapipe waits while the queue is "
              "at work. First dispatch: software drivers generate code there (LLVM), one kernel after another.")
    for stage in stages:
        kernels = sorted(results[techniques[-1], stage].numbers["kernels"], key=lambda k: -k["dispatch_ms"])
        page.table((f"`{stage}`, `{techniques[-1]}`", "SPIR-V", "driver", "first dispatch"),
                   [(k["name"].removeprefix("passes/"), *(number(k[p]) for p in KERNEL_PHASES)) for k in kernels])
        spirv, dispatch = (number(sum(k[p] for k in kernels)) for p in ("spirv_ms", "dispatch_ms"))
        page.text(f"In all {spirv} ms to SPIR-V, {dispatch} ms of first dispatches.")
    return {f"{t} {s}": {k: results[t, s].numbers[k] for k in ("cold", "warm", "kernels")} for t, s in results}
