"""Prints time and error of what tools/demo rendered, against the stored reference by an independent renderer."""

import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "editor/bench"))

from trilume_bench import metrics


def main():
    frame = json.loads((ROOT / "build/demo.json").read_text())["frames"][0]
    reference = metrics.read_pfm(ROOT / "tests/references/cornell_glass.pfm")
    image = metrics.read_pfm(ROOT / "build/demo.pfm")
    image = metrics.block_means(image, image.shape[1] // reference.shape[1])
    print(f"{frame['spp']} samples a pixel in {frame['ms'] / 1e3:.2f} s, {frame['rays'] / frame['ms'] / 1e3:.2f} million rays a second")
    print(f"against the reference at {reference.shape[1]} x {reference.shape[0]}: mean ratio "
          f"{metrics.mean_ratio(image, reference):.4f}, MSE {metrics.mse(image, reference):.4g}, "
          f"relMSE {metrics.relmse(image, reference):.4g}")


if __name__ == "__main__":
    main()
