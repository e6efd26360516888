"""Runs the `trilume` command for tests, and writes the stages that they need."""

import fcntl
import hashlib
import json
import os
import pickle
import re
import signal
import subprocess
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux

from trilume_bench import metrics

ROOT = Path(__file__).resolve().parent.parent
BUILD = Path(os.environ.get("TRILUME_BUILD", ROOT / "build")).resolve()
COMMAND = BUILD / "bin" / "trilume"
CONTENT = ROOT / "content"
REFERENCES = ROOT / "tests" / "references"

# The heavy versions: references at full size, all scenes everywhere.
FULL = os.environ.get("TRILUME_FULL", "0") not in ("", "0")

# Size that tests render at: a third of the references', whose 3x3 blocks have the same expected values by the box filter.
SMALL = (32, 18)
REFERENCE_SIZE = (96, 54)
SIZE = REFERENCE_SIZE if FULL else SMALL

# AOVs of the path classes: with `emission` they add up to the image.
CLASSES = ("direct", "caustic", "indirect")

ERROR_LINE = re.compile(r"trilume: error: .+: .+: .+")


@dataclass
class Run:
    """What one run of the command did. `image` is None unless it succeeded with one output."""

    status: int
    stderr: str
    seconds: float
    image: np.ndarray | None = None
    stats: dict = field(default_factory=dict)
    aovs: dict = field(default_factory=dict)  # by name

    @property
    def errors(self):
        return [line for line in self.stderr.splitlines() if "error" in line.lower()]


def run(*arguments, env=None, timeout=600, cwd=None):
    """Runs the command with `arguments`; never raises for a failing exit status."""
    begun = time.monotonic()
    done = subprocess.run([str(COMMAND), *map(str, arguments)], capture_output=True, text=True, errors="replace",
                          env={**os.environ, **(env or {})}, timeout=timeout, cwd=cwd)
    return Run(done.returncode, done.stderr, time.monotonic() - begun)


def start(*arguments):
    """A running command, with its standard error in a pipe. It can be interrupted, even where tests run in the background."""
    return subprocess.Popen([str(COMMAND), *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                            text=True, errors="replace", preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))


def interrupt(process, timeout=60):
    """Sends what Ctrl-C sends; returns (exit status, standard error)."""
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=timeout)
    return process.returncode, stderr


class Renderer:
    """`render(stage, *options)`: one image and its stats. Equal calls are rendered once, whichever process asks."""

    def __init__(self, folder):
        self.folder = Path(folder)

    def __call__(self, stage, *options, size=None, env=None, aovs=()):
        """stage: a path or the name of a content stage; size: (width, height) in pixels, default SIZE.
        aovs: names of what to return in Run.aovs beside the image; CLASSES are those of the path classes.

        Fails the test when the command fails, the image has another size, or a pixel is not finite.
        """
        width, height = size or SIZE
        stage = find_stage(stage)
        with self._kept((stage, options, width, height, tuple(sorted((env or {}).items())))) as file:
            kept = pickle.loads(file.read_bytes()) if file.exists() else None
            if kept is None or not set(aovs) <= kept.aovs.keys():
                kept = self._render(stage, options, width, height, env, aovs)
                file.write_bytes(pickle.dumps(kept))
        return replace(kept, aovs={name: kept.aovs[name] for name in aovs})

    @contextmanager
    def _kept(self, key):
        """The file for the run of that key, while no other process looks at it."""
        file = self.folder / hashlib.sha256(repr(key).encode()).hexdigest()
        with open(file.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield file

    def _render(self, stage, options, width, height, env, aovs):
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            output, stats = Path(folder) / "image.pfm", Path(folder) / "stats.json"
            files = {name: Path(folder) / f"{name}.pfm" for name in aovs}
            options = (*options, *(o for name, file in files.items() for o in ("--aov", f"{name}={file}")))
            result = run("render", "--progress", "off", "--stats", stats, "--imageWidth", width, "--imageHeight", height,
                         *options, stage, output, env=env)
            assert result.status == 0, f"trilume render {' '.join(map(str, options))} {stage}: {result.stderr}"
            result.image, result.stats = metrics.read_image(output), json.loads(stats.read_text())
            result.aovs = {name: metrics.read_image(file) for name, file in files.items()}
        assert result.image.shape == (height, width, 3)
        assert np.isfinite(result.image).all(), "a pixel that is not finite"
        return result

    def seeds(self, stage, *options, count, first=1, **keywords):
        """`count` independent images, stacked."""
        return np.stack([run.image for run in self.runs(stage, *options, count=count, first=first, **keywords)])

    def runs(self, stage, *options, count, first=1, **keywords):
        """`count` independent runs."""
        return [self(stage, *options, "--seed", seed, **keywords) for seed in range(first, first + count)]


def find_stage(stage):
    path = Path(stage)
    return path if path.is_absolute() else CONTENT / f"{stage}.usda"


@dataclass
class Reference:
    """A stored picture by another renderer, at the size that tests render at."""

    image: np.ndarray
    lamp: np.ndarray          # (height, width): pixels that show a lamp
    relmse: float             # its own expected relMSE
    mean_error: float         # standard error of the mean, relative


def reference(name, size=None):
    """tests/references/NAME.exr, averaged down to `size`, default SIZE."""
    width, height = size or SIZE
    pixels = metrics.read_image(REFERENCES / f"{name}.exr")
    facts = json.loads((REFERENCES / f"{name}.json").read_text())
    factor = pixels.shape[1] // width
    assert (height * factor, width * factor) == pixels.shape[:2]
    blocks = metrics.block_means(pixels, factor)
    return Reference(blocks[..., :3].astype(np.float32), blocks[..., 3] > 0, facts["relmse"] / factor**2,
                     facts["mean_standard_error"] / facts["mean"])


# ---- stages for tests --------------------------------------------------------------------------

HEAD = '#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n'

CAMERA = """
    def Camera "Camera"
    {
        float horizontalAperture = 36
        float verticalAperture = 20.25
        float focalLength = 30
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 0, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
"""

LAMP = """
    def SphereLight "Lamp"
    {
        float inputs:radius = 0.3
        float inputs:intensity = 10
        double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
"""

SQUARE_POINTS = "[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]"


def mesh(points=SQUARE_POINTS, counts="[4]", indices="[0, 1, 2, 3]", extra="", name="Square", material="Matte"):
    return f"""
    def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        point3f[] points = {points}
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {indices}
        uniform token subdivisionScheme = "none"
        rel material:binding = </World/{material}>
        {extra}
    }}
"""


def material(name, **inputs):
    """A UsdPreviewSurface. inputs: a colour is a triple, a token text, anything else a number."""
    def line(key, value):
        if isinstance(value, str):
            return f'token inputs:{key} = "{value}"'
        if isinstance(value, tuple):
            return f"color3f inputs:{key} = ({', '.join(map(str, value))})"
        return f"float inputs:{key} = {value}"

    lines = "\n            ".join(line(*item) for item in inputs.items())
    return f"""
    def Material "{name}"
    {{
        token outputs:surface.connect = </World/{name}/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {lines}
            token outputs:surface
        }}
    }}
"""


def matte(albedo=0.8, emission=0.0, name="Matte"):
    """Lambert."""
    return material(name, diffuseColor=(albedo,) * 3, emissiveColor=(emission,) * 3, ior=1, metallic=0)


GLASS = material("Glass", diffuseColor=(1, 1, 1), ior=1.5, opacity=0, opacityMode="transparent", roughness=0)


def scaled_emission(stage, path, factor):
    """A copy of the stage with the intensity of all its lights times `factor`; returns its path."""
    copy = Usd.Stage.Open(str(find_stage(stage)))
    for prim in copy.Traverse():
        if prim.HasAPI(UsdLux.LightAPI):
            light = UsdLux.LightAPI(prim)
            light.GetIntensityAttr().Set(light.GetIntensityAttr().Get() * factor)
    copy.GetRootLayer().Export(str(path))
    return path


def scaled_stage(stage, path, factor, by="unit"):
    """A copy of the stage, its world `factor` times as large, by its unit or by a transform on the root; returns its path."""
    copy = Usd.Stage.Open(str(find_stage(stage)))
    if by == "unit":
        UsdGeom.SetStageMetersPerUnit(copy, factor * UsdGeom.GetStageMetersPerUnit(copy))
    else:
        UsdGeom.Xformable(copy.GetPrimAtPath("/World")).AddScaleOp().Set(Gf.Vec3f(factor))
        # Whether clipping scales with the camera is no matter here.
        UsdGeom.Camera(copy.GetPrimAtPath("/World/Camera")).GetClippingRangeAttr().Set(Gf.Vec2f(1e-7, 1e9))
    copy.GetRootLayer().Export(str(path))
    return path


def write_stage(path, *parts):
    path.write_text(HEAD + 'def Xform "World"\n{\n' + "".join(parts) + "}\n")
    return path


def require_command():
    if not COMMAND.exists():
        raise FileNotFoundError(f"{COMMAND}: not built: run cmake --build, or point TRILUME_BUILD to the build folder")


