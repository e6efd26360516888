#!/usr/bin/env python3
"""The README's pictures: one frame of each technique, with its time and error, as content/images/<stage>_<technique>.jpg.

tools/gallery.py [STAGE] [WIDTH HEIGHT]; prints a table in Markdown. Time is that of a frame after 16 frames of warm-up, techniques
in turns, error that of the frame against a long run of `reference`. Needs a build, and nothing else running.
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

# Options by picture.
PICTURES = {name: ("-t", name, "--denoise", "off")
            for name in ("raytrace", "ddgi_restir", "ddgi_restir_bpt", "hybrid", "reference")} | {"hybrid_denoised": ("-t", "hybrid")}
REFERENCE_SPP, WARMUP, FRAMES, REPEATS = 128, 16, 9, 3


class Gallery:
    def __init__(self, stage, width, height):
        self.stage, self.size = stage, ("--imageWidth", str(width), "--imageHeight", str(height))
        self.folder = Path(tempfile.mkdtemp())

    def render(self, name, output, *options):
        """Milliseconds of each output frame."""
        stats = self.folder / "stats.json"
        subprocess.run([ROOT / "build/bin/trilume", "render", ROOT / f"content/{self.stage}.usda", output, *PICTURES[name], *self.size,
                        "--stats", stats, "--progress", "off", *options], check=True, capture_output=True)
        return [frame["ms"] for frame in json.loads(stats.read_text())["frames"]]

    def picture(self, name, *options):
        """(linear image, milliseconds); writes the display picture as well."""
        linear = self.folder / "color.pfm"
        ms, = self.render(name, ROOT / f"content/images/{self.stage}_{name}.jpg", "--aov", f"color={linear}", *options)
        return metrics.read_pfm(linear), ms

    def frame_ms(self, name):
        """Of a frame after warm-up."""
        return statistics.median(self.render(name, self.folder / "####.pfm", "-f", f"1:{WARMUP + FRAMES}")[WARMUP:])


def main():
    stage = sys.argv[1] if len(sys.argv) > 1 else "cornell_glass"
    width, height = map(int, sys.argv[2:4]) if len(sys.argv) > 3 else (320, 180)
    gallery = Gallery(stage, width, height)
    truth, total = gallery.picture("reference", "--spp", str(REFERENCE_SPP))
    names = [name for name in PICTURES if name != "reference"]
    times = [{name: gallery.frame_ms(name) for name in names} for _ in range(REPEATS)]
    print("| technique | ms a frame | relMSE | mean ratio |\n|---|---|---|---|")
    for name in names:
        image, _ = gallery.picture(name, "--warmup", str(WARMUP))
        ms = statistics.median(time[name] for time in times)
        print(f"| `{name}` | {ms:.0f} | {metrics.relmse(image, truth):.3g} | {metrics.mean_ratio(image, truth):.3f} |")
    print(f"| `reference`, {REFERENCE_SPP} frames | {total:.0f} in all | | |")


if __name__ == "__main__":
    main()
