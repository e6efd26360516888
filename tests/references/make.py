#!/usr/bin/env python3
"""Renders the stored reference images with Mitsuba 3.

    tests/references/make.py                     every reference that is missing or less exact than wanted
    tests/references/make.py --minutes 10 maze   ten minutes each on the named ones

A reference is NAME.exr (float32 linear Rec. 709) beside NAME.json: samples per pixel, mean radiance with its standard
error, and the reference's own expected relMSE, all measured from independent batches. More batches add to those there
are: sums are kept under build/references, so that a reference can be refined at any time.

Needs `pip install -r tools/requirements-references.txt`; Mitsuba's fast variant needs LLVM 16 or newer (Debian: libllvm19).
"""

import argparse
import glob
import json
import os
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE.parent))

import metrics  # noqa: E402

SIZE = (96, 54)
BATCH = 256  # samples per pixel of one batch; a square, as multi-jittered sampling wants
WANTED = 2e-5  # relMSE of a reference, unless it is marked as caustic

# name: (stage, frame or None, caustic)
REFERENCES = {
    name: (f"content/{name}.usda", None, name == "cornell_glass")
    for name in ("cornell_empty", "cornell_big_light", "cornell_glass", "cornell_light_sphere", "one_box", "five_boxes",
                 "maze", "white_room")
} | {f"animated.{frame:04d}": ("content/animated.usda", frame, False) for frame in (1, 12, 24)}


def choose_variant():
    """The vectorised variant where a recent enough LLVM is found, else the scalar one."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = [p for v in range(21, 15, -1) for p in glob.glob(f"/usr/lib/*/libLLVM*{v}*")]
        if found:
            os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb")
    return mi


def refine(mi, name, seconds, wanted):
    import usd_to_mitsuba

    stage, frame, caustic = REFERENCES[name]
    width, height = SIZE
    scene = usd_to_mitsuba.load(ROOT / stage, width, height, frame)
    kept = ROOT / "build" / "references" / f"{name}.npz"
    kept.parent.mkdir(parents=True, exist_ok=True)
    total, squares, means, batches = np.zeros((height, width, 3)), np.zeros((height, width, 3)), [], 0
    if kept.exists():
        with np.load(kept) as data:
            total, squares, means, batches = data["total"], data["squares"], list(data["means"]), int(data["batches"])

    def error():
        """Expected relMSE of the mean image, from the variance between batches."""
        if batches < 8:
            return np.inf
        mean = total / batches
        variance = (squares / batches - mean**2) / (batches - 1)
        return float(np.mean(variance / (mean**2 + metrics.RELMSE_EPSILON)))

    begun = time.monotonic()
    while error() > wanted and time.monotonic() - begun < seconds:
        for _ in range(8):
            image = np.array(mi.render(scene, spp=BATCH, seed=batches), dtype=np.float64)
            if not np.isfinite(image).all():
                raise RuntimeError(f"{name}: batch {batches}: a pixel that is not finite")
            total, squares, batches = total + image, squares + image**2, batches + 1
            means.append(image.mean())
        np.savez(kept, total=total, squares=squares, means=np.array(means), batches=batches)
    if batches == 0:
        return
    metrics.write_image(HERE / f"{name}.exr", (total / batches).astype(np.float32))
    facts = {
        "stage": stage,
        "frame": frame,
        "caustic": caustic,
        "renderer": f"mitsuba {mi.__version__} path",
        "spp": batches * BATCH,
        "relmse": float(f"{error():.3g}"),
        "mean": float(f"{np.mean(means):.7g}"),
        "mean_standard_error": float(f"{np.std(means, ddof=1) / np.sqrt(batches):.3g}"),
    }
    (HERE / f"{name}.json").write_text(json.dumps(facts, indent=2) + "\n")
    print(f"{name}: {facts['spp']} spp, relMSE {facts['relmse']:.2g}, mean {facts['mean']:.5f} "
          f"+- {facts['mean_standard_error']:.1g}, {time.monotonic() - begun:.0f} s", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="references, or all")
    parser.add_argument("--minutes", type=float, default=5, help="at most this long on each")
    parser.add_argument("--relmse", type=float, default=WANTED, help="stop when the reference is this exact")
    options = parser.parse_args()
    unknown = [n for n in options.names if n not in REFERENCES]
    if unknown:
        parser.error(f"unknown reference {unknown[0]}: choose from {', '.join(REFERENCES)}")
    mi = choose_variant()
    for name in options.names or REFERENCES:
        refine(mi, name, options.minutes * 60, options.relmse)


if __name__ == "__main__":
    main()
