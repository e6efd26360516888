"""`hybrid` in the conditions in which the best open real-time ray tracer of this kind was measured once, with the same driver
and two cores; the target is a fifth of its time at lower error, undenoised against undenoised."""

from dataclasses import dataclass

from . import stages
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
    "the same, which reuses reservoirs": Condition("box", (320, 180), 214, 0.034),
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
        result["rival", name] = Job("frames", 4, {"stage": str(path), "technique": TECHNIQUE, "size": condition.size,
                                                  "warmup": WARMUP, "count": 8 if quick else 32, "seed": bench.settings.seed})
        if condition.relmse:
            result["rival", name, "error"] = Job("convergence", 10 if quick else 70, {
                "stage": str(path), "technique": TECHNIQUE, "size": ERROR_SIZE, "warmup": WARMUP, "count": 8 if quick else 64,
                "seconds": 3 if quick else 30, "seeds": [bench.settings.seed]})
        if name == next(iter(CONDITIONS)):
            result["rival", name, "start"] = Job("startup", 10, {
                "stage": str(path), "technique": TECHNIQUE, "size": condition.size, "runs": 2 if quick else 5,
                "seed": bench.settings.seed})
    return result


def targets(results):
    """(rows of the target table, pictures, summary). At rest frames may be averaged, as far as the time allows."""
    rows, pictures, summary = [], {}, {}
    for name, condition in CONDITIONS.items():
        ms, limit = results["rival", name].numbers["frame_ms"], SHARE * condition.ms
        pictures[condition.stage] = results["rival", name].arrays["one"]
        target, measured, met = f"{limit:.0f} ms", f"{number(ms)} ms", ms <= limit
        summary[name] = {"frame_ms": ms}
        if condition.relmse:
            errors = results["rival", name, "error"].numbers
            frames, error = max(found for found in zip(errors["spp"], errors["relmse"][0]) if found[0] * ms <= limit or found[0] == 1)
            target, measured = f"{target}, relMSE {condition.relmse}", f"{frames} x {measured}, {number(error)}"
            met = met and error < condition.relmse
            summary[name] |= {"frames": frames, "relmse": error}
        width, height = condition.size
        rows.append((f"`{TECHNIQUE}` against another open renderer, {name}, {width} x {height}: a fifth of its time, lower error",
                     target, measured, met))
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
    page.text(f"`{TECHNIQUE}`, not denoised, {WARMUP} frames of warm-up; error at {width} x {height}, of the mean of as many frames as "
              "fit the time, against `reference`. The other's numbers are from one measurement on the same driver and cores.")
    page.plot(draw.contact_sheet(tuple(pictures), ("a frame",), lambda _, stage: pictures[stage], width=3), "rival",
              "What was measured.")
