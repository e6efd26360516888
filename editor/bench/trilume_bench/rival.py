"""`hybrid` in the conditions in which the best open real-time ray tracer of this kind was measured once, with the same driver
and two cores; the target is a fifth of its time at lower error, undenoised against undenoised."""

from dataclasses import dataclass

from . import metrics, stages
from . import report as draw
from .bench import Job
from .report import number

TECHNIQUE, SHARE, WARMUP = "hybrid", 0.2, 16
ERROR_SIZE = (96, 54)  # where a reference without noise takes seconds; noise of a pixel hardly depends on it
FIRST_FRAME = {"warm": 2.7, "cold": 10.0}  # seconds, in the box


@dataclass(frozen=True)
class Condition:
    stage: str            # one of STAGES
    size: tuple
    ms: float             # the other's, of a frame
    relmse: float | None  # the other's; None: not known
    options: tuple = ()


def _box(bench, path, *edits):
    stages.edited(bench.stage("cornell_empty"), path, *edits)


BLOCKS = (stages.block("/World/Tall", (-0.55, 0, -0.4), (0.56, 1.1, 0.56), 18),
          stages.block("/World/Short", (0.5, 0, 0.2), (0.56, 0.56, 0.56), -17))
STAGES = {
    "box": lambda bench, path: _box(bench, path, *BLOCKS),
    "fine_box": lambda bench, path: _box(bench, path, BLOCKS[0],
                                         stages.fine_ball("/World/Ball", (0.5, 0.4, 0.2), 0.4, 96_000)),
    "thousand_lamps": lambda bench, path: stages.hall(path, lamps=1000),
}
CONDITIONS = {
    "box of 32 triangles": Condition("box", (320, 180), 168, 0.072),
    "the same, reservoirs reused": Condition("box", (320, 180), 214, 0.034, ("--set", "restir_di.reuse=spatiotemporal")),
    "box of 96,000 triangles": Condition("fine_box", (320, 180), 323, 0.115),
    "1,000 lamps": Condition("thousand_lamps", (240, 135), 950, None),
}


def jobs(bench):
    quick, result = bench.settings.quick, {}
    folder = bench.settings.output / "stages"
    folder.mkdir(exist_ok=True)
    for name, condition in CONDITIONS.items():
        path = folder / f"{condition.stage}.usda"
        if not path.exists():
            STAGES[condition.stage](bench, path)
        if condition.relmse:
            result["rival", name, "reference"] = Job("reference", 8 if quick else 65, {
                "stage": str(path), "size": ERROR_SIZE, "seconds": 6 if quick else 60})
        sizes = {"time": condition.size, **({"error": ERROR_SIZE} if condition.relmse else {})}
        for what, size in sizes.items():
            result["rival", name, what] = Job("frames", 4, {"stage": str(path), "technique": TECHNIQUE, "size": size,
                                                            "warmup": WARMUP, "count": 8 if quick else 32,
                                                            "seed": bench.settings.seed, "options": condition.options})
        if name == next(iter(CONDITIONS)):
            result["rival", name, "start"] = Job("startup", 10, {
                "stage": str(path), "technique": TECHNIQUE, "size": condition.size, "runs": 2 if quick else 5,
                "seed": bench.settings.seed})
    return result


def targets(results):
    """(rows of the target table, summary)."""
    rows, pictures, summary = [], {}, {}
    for name, condition in CONDITIONS.items():
        found = results["rival", name, "time"]
        ms, limit, error = found.numbers["frame_ms"], SHARE * condition.ms, None
        pictures[name] = {"a frame": found.arrays["one"]}
        target, measured, met = f"{limit:.0f} ms", f"{number(ms)} ms", ms <= limit
        if condition.relmse:
            expected = results["rival", name, "reference"].arrays["image"]
            judged = results["rival", name, "error"].arrays["one"]
            error = metrics.relmse(judged, expected)
            pictures[name] |= {"error is measured in": judged, "reference": expected}
            target, measured = f"{target}, relMSE {condition.relmse}", f"{measured}, {number(error)}"
            met = met and error < condition.relmse
        width, height = condition.size
        rows.append((f"`{TECHNIQUE}`, {name} at {width} x {height}: a fifth of another open renderer's time, lower error",
                     target, measured, met))
        summary[name] = {"frame_ms": ms, "relmse": error}
    start = results["rival", next(iter(CONDITIONS)), "start"].numbers
    for state, seconds in FIRST_FRAME.items():
        found = start[state]["first_frame"] / 1e3
        rows.append((f"first frame in the box, {state} caches: a fifth of the time", f"{SHARE * seconds:.2g} s", f"{number(found)} s",
                     found <= SHARE * seconds))
        summary[f"first frame, {state}"] = found
    return rows, pictures, summary


def show(page, pictures):
    page.heading("In the conditions of another open renderer")
    width, height = ERROR_SIZE
    page.text(f"`{TECHNIQUE}`, not denoised, {WARMUP} frames of warm-up; error of a single frame at {width} x {height} against a long "
              "run of `reference`. The other's numbers are from one measurement on the same driver and cores.")
    page.plot(draw.contact_sheet(("a frame", "error is measured in", "reference"), tuple(pictures),
                                 lambda row, column: pictures[row].get(column), width=3), "rival", "What was measured.")
