#!/usr/bin/env python3
"""Renders the stored reference images with Mitsuba 3.

    tests/references/make.py                     every reference that is missing or less exact than wanted
    tests/references/make.py --minutes 10 maze   ten minutes each on the named ones

A reference is NAME.exr (float32 linear Rec. 709) beside NAME.json: samples per pixel, mean radiance with its standard
error, and the reference's own expected relMSE, all measured from independent batches. A fourth channel marks the pixels
that show a lamp. More batches add to those there
are: sums are kept under build/references, so that a reference can be refined at any time.

Needs `pip install -r tools/requirements-references.txt`; Mitsuba's fast variant needs LLVM 16 or newer (Debian: libllvm19).
"""

import argparse
import dataclasses
import json
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "editor" / "bench"))

from trilume_bench import metrics, offline  # noqa: E402

SIZE = (96, 54)
BATCH = 256  # samples per pixel of one batch; a square, as multi-jittered sampling wants
DEMO = "cornell_glass"  # kept as PFM as well, for tools/demo, which has no package that reads EXR
WANTED = 2e-5  # relMSE of a reference



@dataclasses.dataclass(frozen=True)
class Reference:
    stage: str
    frame: int | None = None
    # Path tracing alone would take hours: light tracing wherever the camera sees a surface that is not specular.
    caustic: bool = False
    # Emission and light reflected once, for the techniques that compute no more.
    direct: bool = False


REFERENCES = {
    name: Reference(f"content/{name}.usda", caustic=name == "cornell_glass")
    for name in ("cornell_empty", "cornell_big_light", "cornell_glass", "cornell_light_sphere", "one_box", "maze",
                 "white_room")  # five_boxes is the picture of one_box: that is its point
} | {
    f"{name}.direct": Reference(f"content/{name}.usda", direct=True) for name in ("cornell_light_sphere", "one_box", "maze")
} | {
    f"animated.{frame:04d}": Reference("content/animated.usda", frame) for frame in (1, 12, 24)
}


class Batches:
    """Independent renderings of the pixels in `mask`: their sums, kept on disk."""

    def __init__(self, name, mask):
        self.file = ROOT / "build" / "references" / f"{name}.npz"
        self.mask, self.count, self.total, self.squares, self.means = mask, 0, 0.0, 0.0, []
        if self.file.exists():
            with np.load(self.file) as data:
                self.total, self.squares, self.means = data["total"], data["squares"], list(data["means"])
                self.count = len(self.means)

    def add(self, render):
        """render(seed) -> image."""
        image = np.array(render(self.count), dtype=np.float64)
        if not np.isfinite(image).all():
            raise RuntimeError(f"{self.file.stem}: batch {self.count}: a pixel that is not finite")
        self.count, self.total, self.squares = self.count + 1, self.total + image, self.squares + image**2
        self.means.append(image[self.mask].mean())

    def save(self):
        self.file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(self.file, total=self.total, squares=self.squares, means=np.array(self.means))

    def mean(self):
        return self.total / self.count

    def variance(self):
        """Of the mean, per pixel and channel."""
        return (self.squares / self.count - self.mean() ** 2) / (self.count - 1)

    def variance_of_sum(self):
        """Of the mean image's mean over the mask, times the mask's share of the picture: they add up."""
        return np.var(self.means, ddof=1) / self.count * self.mask.mean() ** 2


def seen_first(mi, scene):
    """Which pixels show a lamp, and which a specular surface, anywhere in them: two masks (height, width)."""
    import drjit as dr

    sensor, grid = scene.sensors()[0], 8
    width, height = SIZE
    x, y = np.meshgrid((np.arange(width * grid) + 0.5) / (width * grid), (np.arange(height * grid) + 0.5) / (height * grid))
    film = mi.Point2f(mi.Float(x.ravel().astype(np.float32)), mi.Float(y.ravel().astype(np.float32)))
    hit = scene.ray_intersect(sensor.sample_ray(0.0, 0.5, film, mi.Point2f(0.5))[0])
    lamp = dr.neq(hit.emitter(scene), None) if hasattr(dr, "neq") else hit.emitter(scene) != None  # noqa: E711
    specular = mi.has_flag(hit.bsdf().flags(), mi.BSDFFlags.Delta) & hit.is_valid()
    pixels = lambda mask: np.array(mask).reshape(height, grid, width, grid).any(axis=(1, 3))
    return pixels(lamp), pixels(specular)


def refine(mi, name, seconds, wanted):
    from trilume_bench import usd_to_mitsuba

    what = REFERENCES[name]
    width, height = SIZE
    scene = usd_to_mitsuba.load(ROOT / what.stage, width, height, what.frame)
    lamp, specular = seen_first(mi, scene)
    depth = 2 if what.direct else -1
    # Light tracing can't reach a pixel that shows a lamp or a specular surface.
    by_path = lamp | specular if what.caustic else np.full_like(lamp, True)
    kinds = ("path", "ptracer") if what.caustic else ("path",)
    integrators = {kind: mi.load_dict({"type": kind, "max_depth": depth, "rr_depth": 8}) for kind in kinds}
    batches = {kind: Batches(f"{name}.{kind}", by_path if kind == "path" else ~by_path) for kind in kinds}

    def combine(get):
        return np.where(by_path[..., None], get(batches["path"]), get(batches[kinds[-1]]))

    def error():
        """Expected relMSE of the mean image, from the variance between batches."""
        if min(b.count for b in batches.values()) < 8:
            return np.inf
        return float(np.mean(combine(Batches.variance) / (combine(Batches.mean) ** 2 + metrics.RELMSE_EPSILON)))

    begun = time.monotonic()
    while error() > wanted and time.monotonic() - begun < seconds:
        for kind, integrator in integrators.items():
            for _ in range(8):
                batches[kind].add(lambda seed: mi.render(scene, integrator=integrator, spp=BATCH, seed=seed))
            batches[kind].save()
    if error() == np.inf:
        return
    mean = combine(Batches.mean)
    metrics.write_image(HERE / f"{name}.exr", np.dstack([mean, lamp]), ("R", "G", "B", "lamp"))
    if name == DEMO:
        metrics.write_pfm(HERE / f"{name}.pfm", mean)
    facts = {
        "stage": what.stage,
        "frame": what.frame,
        "caustic": what.caustic,
        "renderer": f"mitsuba {mi.__version__} {'+'.join(integrators)}",
        "spp": {kind: b.count * BATCH for kind, b in batches.items()},
        "relmse": float(f"{error():.3g}"),
        "mean": float(f"{mean.mean():.7g}"),
        "mean_standard_error": float(f"{np.sqrt(sum(b.variance_of_sum() for b in batches.values())):.3g}"),
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
    mi = offline.choose_variant()
    for name in options.names or REFERENCES:
        refine(mi, name, options.minutes * 60, options.relmse)


if __name__ == "__main__":
    main()
