"""Kinds of measurement. Each returns (numbers for JSON, arrays); images are float32 (height, width, 3), linear.

A change of this file makes stored measurements stale.
"""

import math

import numpy as np

from . import metrics
from .command import median_nodes

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
        "accel": {k: max(f["accel"][k] for f in facts[warmup:]) for k in last["accel"]},
        "nonfinite": sum(f["nonfinite"] for f in facts) + metrics.nonfinite(images),
        "frame_means": images.mean(axis=(1, 2, 3), dtype=np.float64).tolist(),
        "memory_bytes": max(f["memory_bytes"] for f in facts), "flicker": metrics.flicker(images) if len(images) > 1 else 0.0,
        "startup_ms": rendered.stats["startup_ms"], "tracer": rendered.stats["tracer"], "unowned": last["unowned"],
    }, {"one": images[-1], "equal": images[:averaged].mean(axis=0), "mean": images.mean(axis=0)}


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
