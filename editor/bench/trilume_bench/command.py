"""Runs `trilume render` and reads back what it wrote."""

import json
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import metrics
from .errors import RUN, BenchError

TIMEOUT = 3600  # seconds


@dataclass
class Rendered:
    images: list   # of each output frame (height, width, 3)
    stats: dict    # --stats
    aovs: dict     # name: image of the first output frame


class Command:
    """The command at `path`, with `options` that every call gets."""

    def __init__(self, path, options=()):
        self.path, self.options = str(path), [str(o) for o in options]

    def info(self):
        return json.loads(self._run(["info", "--json"]))

    def render(self, stage, size, options=(), frames=None, aovs=(), env=None):
        """size: (width, height). frames: a frame spec, or None for one picture."""
        with tempfile.TemporaryDirectory(prefix="trilume-bench-") as folder:
            folder = Path(folder)
            stats = folder / "stats.json"
            output = folder / ("image.pfm" if frames is None else "image.######.pfm")
            words = ["render", stage, output, "--imageWidth", size[0], "--imageHeight", size[1], "--progress", "off",
                     "--stats", stats, *self.options, *options]
            if frames is not None:
                words += ["-f", frames]
            for name in aovs:
                words += ["--aov", f"{name}={folder / ('aov.' + name)}{'' if frames is None else '.######'}.pfm"]
            self._run(words, env)
            return Rendered([metrics.read_pfm(p) for p in sorted(folder.glob("image*.pfm"))], json.loads(stats.read_text()),
                            {name: metrics.read_pfm(min(folder.glob(f"aov.{name}*.pfm"))) for name in aovs})

    def _run(self, words, env=None):
        process = subprocess.Popen([self.path, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   errors="replace", env={**os.environ, **(env or {})})
        try:
            out, err = process.communicate(timeout=TIMEOUT)
        except BaseException:
            process.kill()
            process.wait()
            raise
        if process.returncode != 0:
            lines = [line for line in err.splitlines() if "error" in line] or err.splitlines() or ["no message"]
            raise BenchError(RUN, "a measurement failed", " ".join([self.path, *map(str, words)]),
                             lines[-1].removeprefix("trilume: error: "))
        return out


def median_nodes(frames):
    """{node: median milliseconds} over output frames of the statistics."""
    names = [node["name"] for node in frames[-1]["nodes"]]
    times = {name: [n["ms"] for f in frames for n in f["nodes"] if n["name"] == name] for name in names}
    return {name: float(np.median(ms)) for name, ms in times.items()}
