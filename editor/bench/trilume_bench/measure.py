"""Kinds of measurement. Each returns (numbers for JSON, arrays); images are float32 (height, width, 3), linear.

A change of this file makes stored measurements stale.
"""

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from . import metrics
from .command import median_nodes
from .errors import INPUT, RUN, BenchError

MOST_FRAMES = 2000


def frames(bench, stage, technique, size, warmup, count, seed, budget_ms=0, options=()):
    """Single frames of a stage at rest, after `warmup` of them: times, and pictures averaged over equal time.

    count: frames after warm-up; more when these don't fill `budget_ms`. Arrays: one, the last frame; equal, the mean of
    as many frames as fill the budget, at least one; mean, of all. Frames are a sequence of output frames of one process,
    so that their times leave out start-up.
    """
    def render(count):
        return bench.command.render(bench.stage(stage), size, ["-t", technique, "--denoise", "off", "--seed", seed, *options],
                                    frames=f"1:{warmup + count}")

    rendered = render(count)
    spent = _times(rendered)[warmup:].sum()
    if spent < budget_ms:
        count = min(MOST_FRAMES, math.ceil(1.25 * count * budget_ms / spent))
        rendered = render(count)
    ms, images = _times(rendered), np.stack(rendered.images[warmup:])
    averaged = min(count, int(np.searchsorted(np.cumsum(ms[warmup:]), budget_ms)) + 1)
    facts = rendered.stats["frames"]
    last = facts[-1]
    return {
        "ms": ms.tolist(), "warmup": warmup, "frame_ms": float(np.median(ms[warmup:])),
        "averaged": averaged, "equal_ms": float(ms[warmup:warmup + averaged].sum()),
        "nodes": median_nodes(facts[warmup:]), "states": {n["name"]: [n["state"], n["reason"]] for n in last["nodes"]},
        "rays": float(np.median([f["rays"] for f in facts[warmup:]])), "photons": last["photons"], "probes": last["probes"],
        "host_ms": float(np.median([f["host_ms"] for f in facts[warmup:]])), "uploaded_bytes": [f["uploaded_bytes"] for f in facts],
        "accel": {k: max(f["accel"][k] for f in facts[warmup:]) for k in last["accel"]},
        "nonfinite": sum(f["nonfinite"] for f in facts) + metrics.nonfinite(images),
        "frame_means": images.mean(axis=(1, 2, 3), dtype=np.float64).tolist(),
        "memory_bytes": max(f["memory_bytes"] for f in facts), "flicker": metrics.flicker(images) if len(images) > 1 else 0.0,
        "startup_ms": rendered.stats["startup_ms"], "tracer": rendered.stats["tracer"], "unowned": last["unowned"],
    }, {"one": images[-1], "equal": images[:averaged].mean(axis=0), "mean": images.mean(axis=0)}


def curve(bench, stage, technique, size, warmup, count, seconds, seed, options=(), aovs=()):
    """Averages of growing length after warm-up: means of up to `count` single frames, then a run of `--time` for each of
    `seconds`. Arrays: images, one per row of `ms` and `spp`; and AOVs of the longest run."""
    flags = ["-t", technique, "--denoise", "off", "--seed", seed, *options]
    path = bench.stage(stage)
    rendered = bench.command.render(path, size, flags, frames=f"1:{warmup + count}")
    spent = np.cumsum(_times(rendered)[warmup:])
    sums = np.cumsum(rendered.images[warmup:], axis=0, dtype=np.float64)
    spp = sorted({min(count, 2**k) for k in range(count.bit_length() + 1)})
    ms, images = [float(spent[n - 1]) for n in spp], [sums[n - 1] / n for n in spp]
    facts = rendered.stats["frames"]
    bad, first = sum(f["nonfinite"] for f in facts), facts[0]["ms"]
    for index, limit in enumerate(seconds):
        last = index == len(seconds) - 1
        rendered = bench.command.render(path, size, [*flags, "--warmup", warmup, "--time", limit], aovs=aovs if last else ())
        frame = rendered.stats["frames"][0]
        spp.append(frame["spp"])
        ms.append(frame["ms"] - frame["warmup_ms"])
        images.append(rendered.images[0])
        bad += frame["nonfinite"] + metrics.nonfinite(rendered.images[0])
    return {"spp": spp, "ms": ms, "first_frame_ms": first, "frame_ms": float(np.median(np.diff(spent, prepend=0))),
            "nonfinite": bad, "unowned": rendered.stats["frames"][0]["unowned"]}, \
        {"images": np.array(images, dtype=np.float32), **rendered.aovs}


def convergence(bench, stage, technique, size, warmup, count, seconds, seeds, direct=False):
    """relMSE of means of 1, 2, 4 ... `count` single frames after warm-up, for each seed over all such means in its run, against
    two independent long runs of `reference`, whose noise drops out. direct: of direct light alone."""
    path = bench.stage(stage)
    names = ("direct", "emission") if direct else ()
    expected = []
    for number in range(2):
        flags = ["-t", "reference", "--denoise", "off", "--time", seconds, "--seed", 900_002 + number]
        rendered = bench.command.render(path, size, flags, aovs=names)
        expected.append(sum(rendered.aovs.values()) if direct else rendered.images[0])
    samples, runs, bad = [2**k for k in range(count.bit_length())], [], 0
    for seed in seeds:
        rendered = bench.command.render(path, size, ["-t", technique, "--denoise", "off", "--seed", seed], frames=f"1:{warmup + count}")
        runs.append(metrics.falling_errors(np.stack(rendered.images[warmup:]), *expected, samples))
        bad += sum(f["nonfinite"] for f in rendered.stats["frames"])
    return {"spp": samples, "relmse": runs, "nonfinite": bad}, {}


def offline(bench, stage, size, seconds, seed, renderer="mitsuba"):
    """What Mitsuba or Cycles computes in the same time on the same cores, if it is installed; `installed` tells. Cycles may have a
    Python of its own, TRILUME_CYCLES_PYTHON, as bpy wants an older NumPy; its stages are converted with Mitsuba's help."""
    python = os.environ.get("TRILUME_CYCLES_PYTHON") or (sys.executable if importlib.util.find_spec("bpy") else None)
    if importlib.util.find_spec("mitsuba") is None or (renderer == "cycles" and python is None):
        return {"installed": False}, {}
    with tempfile.TemporaryDirectory(prefix="trilume-bench-") as folder:
        output, here = Path(folder) / "out.npz", Path(__file__).parent
        if renderer == "cycles":
            scene = Path(folder) / "scene.json"
            _run([sys.executable, "-m", "trilume_bench.usd_to_cycles", bench.stage(stage), *size, scene], "Cycles", stage)
            words = [python, "-I", here / "render_cycles.py", scene, *size, seconds, seed, output]
        else:
            words = [sys.executable, "-m", "trilume_bench.offline", bench.stage(stage), *size, seconds, seed, output]
        _run(words, renderer, stage)
        with np.load(output) as data:
            return {"installed": True, "renderer": str(data["renderer"]), "spp": data["spp"].tolist(),
                    "ms": data["ms"].tolist()}, {"images": data["images"]}


def reference(bench, stage, size, seconds, aovs=()):
    """The expected picture: stored, by an independent renderer, where there is one of a size that fits; else a long run of
    `reference`. `noise`: its own expected MSE, and of the mean the relative standard error."""
    stored = None if aovs else _stored_reference(bench, stage, size)
    if stored is not None:
        return {"source": "independent renderer (Mitsuba 3)", "ms": 0}, {"image": stored}
    rendered = bench.command.render(bench.stage(stage), size, ["-t", "reference", "--denoise", "off", "--time", seconds,
                                                               "--seed", 900_001], aovs=(*aovs, "variance"))
    facts = rendered.stats["frames"][0]
    arrays = {"image": rendered.images[0], **{name: rendered.aovs[name] for name in aovs}}
    return {"source": f"technique `reference`, {facts['spp']} samples a pixel", "ms": facts["ms"],
            "noise": float(np.mean(rendered.aovs["variance"]))}, arrays


def _stored_reference(bench, stage, size):
    path = bench.references / f"{stage}.exr"
    if not path.exists():
        return None
    pixels = metrics.read_image(path)[..., :3]
    factor = pixels.shape[1] // size[0]
    if factor == 0 or (size[1] * factor, size[0] * factor) != pixels.shape[:2]:
        return None
    return metrics.block_means(pixels, factor).astype(np.float32)


def _times(rendered):
    return np.array([frame["ms"] for frame in rendered.stats["frames"]])


def average(bench, stage, technique, size, spp, warmup, seed, options=()):
    """One picture of `spp` frames after warm-up."""
    rendered = bench.command.render(bench.stage(stage), size, ["-t", technique, "--denoise", "off", "--spp", spp, "--warmup",
                                                               warmup, "--seed", seed, *options])
    frame = rendered.stats["frames"][0]
    return {"ms": frame["ms"], "nonfinite": frame["nonfinite"], "memory_bytes": frame["memory_bytes"],
            "startup_ms": rendered.stats["startup_ms"]}, {"image": rendered.images[0]}


def animation(bench, stage, technique, size, frames, seed):
    """Every frame of an animation; flicker of the last eight, should they be at rest."""
    rendered = bench.command.render(bench.stage(stage), size, ["-t", technique, "--seed", seed], frames=f"1:{frames}")
    facts = rendered.stats["frames"]
    return {"ms": [round(f["ms"], 3) for f in facts], "nonfinite": sum(f["nonfinite"] for f in facts),
            "flicker": metrics.flicker(np.clip(rendered.images[-8:], 0, 1)),
            # Clipped: the few pixels that show a lamp would outweigh all others.
            "means": [float(np.clip(i, 0, 1).mean(dtype=np.float64)) if np.isfinite(i).all() else math.nan
                      for i in rendered.images]}, {"last": rendered.images[-1]}


def soak(bench, stage, size, frames, seed, options=()):
    """One process in which everything is switched while the stage's time goes round, by editor/bench/soak."""
    words = ["--frames", frames, "--width", size[0], "--height", size[1], "--seed", seed, *bench.command.options, *options]
    return _program(bench, "bench_soak", [bench.stage(stage), *words], "build the applications"), {}


def startup(bench, stage, technique, size, runs, seed):
    """Start-up with empty caches, then `runs` times with what the first left there; and what each kernel took at first."""
    with tempfile.TemporaryDirectory(prefix="trilume-bench-") as cache:
        # Mesa and NVIDIA keep compiled shaders beside ours.
        env = {"XDG_CACHE_HOME": cache, "MESA_SHADER_CACHE_DIR": cache, "__GL_SHADER_DISK_CACHE_PATH": cache}
        times, kernels = [], []
        for _ in range(1 + runs):
            begun = time.monotonic()
            rendered = bench.command.render(bench.stage(stage), size, ["-t", technique, "--denoise", "off", "--seed", seed],
                                            env=env)
            times.append({**rendered.stats["startup_ms"], "process": 1e3 * (time.monotonic() - begun)})
            kernels = kernels or rendered.stats["pipelines"]
    return {"cold": times[0], "warm": {key: float(np.median([t[key] for t in times[1:]])) for key in times[0]},
            "kernels": kernels, "samples": times}, {}


def tracer(bench, rays, repeats, scene):
    """Rays per second of both tracers and Embree, by tests/bench/tracer."""
    words = ["--json", "--rays", rays, "--repeats", repeats, "--scene", scene]
    return _program(bench, "bench_tracer", words, "install Embree 3 (tools/bootstrap --test) and configure with TRILUME_TESTS=ON"), {}


def _program(bench, name, words, hint):
    """What a program beside the command prints as JSON."""
    program = bench.settings.home / "bin" / name
    if not program.exists():
        raise BenchError(INPUT, "not built", program, hint)
    return json.loads(_run([program, *words], name, program))


def _run(words, name, where):
    """Standard output."""
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise BenchError(RUN, f"{name} failed", where, (done.stderr.splitlines() or ["no message"])[-1])
    return done.stdout
