#!/usr/bin/env python3
"""The README's pictures: one frame of each technique, with its time and error, as content/images/<stage>_<technique>.jpg.

tools/gallery.py [STAGE] [WIDTH HEIGHT]; prints a table in Markdown. Time is that of a frame after 16 frames of warm-up,
error that of the frame against a long run of `reference`. Needs a build, and nothing else running.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "editor/bench"))

from trilume_bench import metrics

TECHNIQUES = ("raytrace", "ddgi_restir", "ddgi_restir_bpt", "hybrid")
REFERENCE_SPP, WARMUP, FRAMES = 128, 16, 9


class Gallery:
    def __init__(self, stage, width, height):
        self.stage, self.size = stage, (width, height)
        self.folder = Path(tempfile.mkdtemp())

    def render(self, technique, *options):
        """(linear image, milliseconds in all); writes the display picture as well."""
        picture, linear, stats = ROOT / f"content/images/{self.stage}_{technique}.jpg", self.folder / "a.pfm", self.folder / "a.json"
        subprocess.run([ROOT / "build/bin/trilume", "render", ROOT / f"content/{self.stage}.usda", picture, "-t", technique,
                        "--imageWidth", str(self.size[0]), "--imageHeight", str(self.size[1]), "--denoise", "off",
                        "--aov", f"color={linear}", "--stats", stats, "--progress", "off", *options], check=True)
        return metrics.read_pfm(linear), json.loads(stats.read_text())["frames"][0]["ms"]

    def frame(self, technique):
        """(image of one frame, milliseconds of the frames after it): a difference, so that start and warm-up drop out."""
        times = []
        for _ in range(3):
            _, many = self.render(technique, "--warmup", str(WARMUP + FRAMES - 1))
            image, one = self.render(technique, "--warmup", str(WARMUP))
            times.append((many - one) / (FRAMES - 1))
        return image, statistics.median(times)


def main():
    stage = sys.argv[1] if len(sys.argv) > 1 else "cornell_glass"
    width, height = map(int, sys.argv[2:4]) if len(sys.argv) > 3 else (320, 180)
    gallery = Gallery(stage, width, height)
    truth, total = gallery.render("reference", "--spp", str(REFERENCE_SPP))
    print("| technique | ms a frame | relMSE | mean ratio |\n|---|---|---|---|")
    for technique in TECHNIQUES:
        image, ms = gallery.frame(technique)
        print(f"| `{technique}` | {ms:.0f} | {metrics.relmse(image, truth):.3g} | {metrics.mean_ratio(image, truth):.3f} |")
    print(f"| `reference`, {REFERENCE_SPP} frames | {total:.0f} in all | | |")


if __name__ == "__main__":
    main()
