"""Mitsuba 3 on the same stages and cores, in a process of its own: python -m trilume_bench.offline STAGE WIDTH HEIGHT SECONDS SEED OUT.npz

Doubles the samples per pixel until a picture takes SECONDS. Loading and compiling are left out: each picture is rendered
twice, with the same kernels, and the second is timed.
"""

import glob
import os
import sys
import time

import numpy as np


def choose_variant():
    """The vectorised variant where a recent enough LLVM is found, else the scalar one."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = [p for v in range(21, 15, -1) for p in glob.glob(f"/usr/lib/*/libLLVM*{v}*")]
        if found:
            os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb")
    return mi


def measure(stage, size, seconds, seed):
    """(samples per pixel, milliseconds, pictures) of growing averages."""
    mi = choose_variant()
    from . import usd_to_mitsuba

    scene = usd_to_mitsuba.load(stage, *size)
    spp, spps, times, images = 1, [], [], []
    while not times or times[-1] < 1e3 * seconds:
        for timed in (False, True):
            if timed or len(times) < 2 or times[-1] < 500:  # kernels are compiled once; samplers differ for few samples
                begun = time.monotonic()
                image = np.array(mi.render(scene, spp=spp, seed=2 * seed + timed), dtype=np.float32)
        spps.append(spp)
        times.append(1e3 * (time.monotonic() - begun))
        images.append(image)
        spp *= 4
    return spps, times, images


def main():
    stage, width, height, seconds, seed, output = sys.argv[1:]
    spps, times, images = measure(stage, (int(width), int(height)), float(seconds), int(seed))
    import mitsuba as mi

    np.savez(output, spp=spps, ms=times, images=images, renderer=f"Mitsuba {mi.__version__}, {mi.variant()}")


if __name__ == "__main__":
    main()
