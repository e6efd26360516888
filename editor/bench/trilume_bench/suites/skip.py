"""What a scene doesn't need, and what has not changed, must cost nothing: time, rays, builds and memory by node."""

from .. import report as draw
from .. import stages
from ..bench import Job
from ..report import number

SIZE, QUICK_SIZE = (320, 180), (160, 90)
FRAMES, WARMUP = 64, 48  # probes take their time to settle
TECHNIQUE = "hybrid"
BASE = "cornell_glass"
MOTIONS = {
    "static": (),
    "moving light": (stages.moving("/World/Lamp", (0.8, 0, 0), FRAMES),),
    "moving object": (stages.moving("/World/GlassSphere", (0.5, 0, 0), FRAMES),),
    "moving camera": (stages.moving("/World/Camera", (0.3, 0, 0), FRAMES),),
}
# scene: what it does not need of `hybrid`.
NEEDS = {"cornell_glass": None, "cornell_empty": "caustics", "cornell_light_sphere": "caustics"}
CROWD = (1, 10_000)  # things at rest beside one that moves
CROWDS = "one of many"
OVERHEAD = "overhead"  # of the engine: a frame of next to no pixels
EMPTY, OVERHEAD_SIZE = "cornell_empty", (16, 9)
STATES = {"run": "", "skipped": "skipped: ", "idle": "idle: "}


def plan(bench):
    s = bench.settings
    return s.choose((*MOTIONS, *NEEDS, CROWDS, OVERHEAD), s.stages, "--stage"), QUICK_SIZE if s.quick else SIZE


def jobs(bench):
    names, size = plan(bench)
    folder = bench.settings.output / "stages"
    folder.mkdir(exist_ok=True)
    result = {}

    def add(key, stage, options=(), technique=TECHNIQUE, warmup=WARMUP, count=FRAMES - WARMUP, size=size):
        result[key] = Job("frames", 6, {"stage": stage, "technique": technique, "size": size, "warmup": warmup,
                                        "count": count, "seed": bench.settings.seed, "options": options})

    for name in names:
        if name == CROWDS:
            for count in CROWD:
                path = folder / f"one_of_{count}.usda"
                if not path.exists():
                    stages.hall(path, instances=count)
                    stages.edited(path, path, stages.sphere("/World/Mover", (0, 1, 0), 0.2),
                                  stages.moving("/World/Mover", (2, 0, 0), FRAMES))
                add((name, count), str(path), technique="raytrace")
        elif name == OVERHEAD:
            add((name, "static"), EMPTY, size=OVERHEAD_SIZE)
            path = folder / "overhead.usda"
            stages.edited(bench.stage(EMPTY), path, stages.moving("/World/Lamp", (0.8, 0, 0), FRAMES))
            add((name, "moving light"), str(path), size=OVERHEAD_SIZE)
        elif name in MOTIONS:
            path = folder / f"{name.replace(' ', '_')}.usda"
            stages.edited(bench.stage(BASE), path, *MOTIONS[name])
            add(name, str(path))
            if name == "static":
                add((name, "first"), str(path), warmup=0, count=1)
                add((name, "second"), str(path), warmup=1, count=1)
        else:
            add(name, name)
            if NEEDS[name]:
                add((name, "without"), name, ["--disable", NEEDS[name]])
    return result


def node_cell(numbers, node):
    state, reason = numbers["states"][node]
    return f"{number(numbers['nodes'][node])} ms" if state == "run" else STATES[state] + reason


def report(bench, page, results):
    names, size = plan(bench)
    page.text(f"`{TECHNIQUE}` at {size[0]} x {size[1]}, not denoised, medians of {FRAMES - WARMUP} frames after {WARMUP} of warm-up.")
    moving, scenes = [n for n in names if n in MOTIONS], [n for n in names if n in NEEDS]
    rows = []
    if "static" in moving:
        n = results["static"].numbers
        idle = n["nodes"]["ddgi"] + n["nodes"]["caustics"]
        rows.append(("static scene: indirect and caustic nodes", "near 0 ms",
                     f"ddgi {number(n['nodes']['ddgi'])}, caustics {number(n['nodes']['caustics'])} ms", idle < 1))
        first = results["static", "first"].numbers["nodes"]
        share = idle / (first["ddgi"] + first["caustics"])
        rows.append(("static scene: these nodes, of what they cost in the first frame", "at most 10%", f"{share:.1%}", share <= 0.1))
        second = results["static", "second"].numbers
        built, uploaded = sum(second["accel"].values()), second["uploaded_bytes"][1]
        rows.append(("static scene: builds and bytes uploaded in the second frame", "0, 0", f"{built}, {uploaded}",
                     built == uploaded == 0))
    if CROWDS in names:
        host = [results[CROWDS, count].numbers["host_ms"] for count in CROWD]
        rows.append((f"one thing that moves beside {CROWD[1]} at rest, against one beside {CROWD[0]}: processor time",
                     "1 ms more at most", f"{number(host[1])} against {number(host[0])} ms", host[1] - host[0] <= 1))
    if OVERHEAD in names:
        host = {what: results[OVERHEAD, what].numbers["host_ms"] for what in ("static", "moving light")}
        rows.append((f"engine and graph, processor time of a frame of {EMPTY}: static, moving light", "below 0.3 ms",
                     ", ".join(f"{number(ms)} ms" for ms in host.values()), max(host.values()) < 0.3))
    for name in scenes:
        if NEEDS[name]:
            with_, without = results[name].numbers, results[name, "without"].numbers
            rays, memory = with_["rays"] - without["rays"], with_["memory_bytes"] - without["memory_bytes"]
            ms = with_["nodes"][NEEDS[name]]
            rows.append((f"`{NEEDS[name]}` in {name}, against the same with it disabled", "0 ms, 0 rays, no memory",
                         f"{number(ms)} ms, {rays:.0f} rays, {memory} bytes", ms == 0 and rays == 0 and memory == 0))
    page.targets(rows)
    nodes = list(next(iter(results.values())).numbers["nodes"])
    names = moving + scenes
    for title, group in (("Motion", moving), ("Scenes", scenes)):
        if group:
            page.heading(title)
            page.table(("", "ms a frame", "of it on the host", "rays", "probes updated of active", "photons",
                            "built: BLAS, refits, TLAS", "bytes uploaded", *nodes),
                       [(name, number(n["frame_ms"]), number(n["host_ms"]), f"{n['rays']:.0f}",
                         f"{n['probes']['updated']} of {n['probes']['active']}", n["photons"],
                         ", ".join(str(v) for v in n["accel"].values()), max(n["uploaded_bytes"][WARMUP:]),
                         *(node_cell(n, node) for node in nodes))
                        for name in group for n in [results[name].numbers]])
    if not names:
        return {}
    figure, axes = draw.plt.subplots(figsize=(9, 3.2))
    bottom = [0.0] * len(names)
    for index, node in enumerate(nodes):
        heights = [results[name].numbers["nodes"].get(node, 0.0) for name in names]
        axes.bar(names, heights, bottom=bottom, label=node, color=draw.plt.cm.tab10(index))
        bottom = [b + h for b, h in zip(bottom, heights)]
    axes.set_ylabel("ms a frame")
    axes.tick_params(axis="x", labelrotation=15)
    axes.legend(ncols=len(nodes), loc="lower left", bbox_to_anchor=(0, 1.0), fontsize=8)
    page.plot(figure, "skip", "Time by node.")
    return {str(key): {k: r.numbers[k] for k in ("frame_ms", "host_ms", "nodes", "states", "rays", "accel", "uploaded_bytes", "probes",
                                            "memory_bytes")}
            for key, r in results.items()}
