"""What tools/compare runs."""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "editor" / "bench"))

from trilume_bench import metrics


def main():
    parser = argparse.ArgumentParser(prog="compare", description="Compares two linear images.")
    parser.add_argument("result")
    parser.add_argument("reference", help="same size, or a whole multiple of it: averaged down")
    parser.add_argument("picture", nargs="?", help="PNG of the signed difference of luminance, full colour at 10%%")
    options = parser.parse_args()
    image, reference = (metrics.read_image(p)[..., :3] for p in (options.result, options.reference))
    factor = reference.shape[1] // image.shape[1]
    if (image.shape[0] * factor, image.shape[1] * factor) != reference.shape[:2]:
        sys.exit(f"compare: error: sizes {image.shape[1::-1]} and {reference.shape[1::-1]}: no whole multiple")
    reference = metrics.block_means(reference, factor)
    print(f"mse {metrics.mse(image, reference):.4g}  relmse {metrics.relmse(image, reference):.4g}  "
          f"mean ratio {metrics.mean_ratio(image, reference):.5f}")
    if options.picture:
        metrics.write_png(options.picture, metrics.difference(image, reference))


if __name__ == "__main__":
    main()
