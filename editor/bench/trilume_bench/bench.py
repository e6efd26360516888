"""What suites have in common: settings, jobs, and a runner that measures each job once."""

import hashlib
import json
import os
import platform
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import command, measure, progress, store
from .errors import INPUT, BenchError


@dataclass(frozen=True)
class Settings:
    suite: str
    home: Path            # of the installation or build tree
    program: Path         # the `trilume` command
    output: Path
    quick: bool = False
    seed: int = 0
    repeats: int = 0      # 0: the suite's own number
    device: str = "auto"
    tracer: str = "auto"
    techniques: tuple = ()  # empty: the suite's own
    stages: tuple = ()
    progress: str = "auto"

    def choose(self, names, chosen, option):
        """Those of `names` that were asked for; all when none were."""
        unknown = [name for name in chosen if name not in names]
        if unknown:
            raise BenchError(INPUT, f"not in suite {self.suite}", f"{option} {unknown[0]}", f"choose from {', '.join(names)}")
        return [name for name in names if not chosen or name in chosen]

    def seeds(self, repeats):
        return range(self.seed, self.seed + (self.repeats or repeats))


@dataclass(frozen=True)
class Job:
    """One measurement: `measure.<kind>(bench, **arguments)`; `weight`: expected seconds on two cores."""

    kind: str
    weight: float
    arguments: dict = field(default_factory=dict)

    def name(self):
        words = (self.arguments.get(key) for key in ("stage", "technique", "case"))
        return " ".join(Path(str(word)).stem for word in words if word)


@dataclass(frozen=True)
class Result:
    job: Job
    numbers: dict
    arrays: dict


class Bench:
    def __init__(self, settings):
        self.settings = settings
        self.content = settings.home / "share/trilume/content"
        self.references = settings.home / "share/trilume/references"
        self.command = command.Command(settings.program, ["--device", settings.device, "--tracer", settings.tracer])
        self.info = command.Command(settings.program).info()
        here = Path(__file__).parent
        libraries = sorted((settings.home / "lib").glob("libtrilume.so")) + sorted(
            (settings.home / "lib/trilume/plugins").glob("*/*.so"))
        share = settings.home / "share/trilume"
        shaders = os.environ.get("TRILUME_SHADERS", share / "shaders")
        build = store.fingerprint([settings.program, *sorted((settings.home / "bin").glob("bench_*")), *libraries, shaders, share / "techniques.json",
                                   here / "measure.py", here / "command.py", here / "metrics.py"])
        devices = json.dumps([self.info["devices"], settings.device, settings.tracer])
        self.store = store.Store(settings.output / "samples", hashlib.sha256((build + devices).encode()).hexdigest())

    def stage(self, name):
        """Path of a content stage, or of one that a suite has written."""
        return Path(name) if Path(name).is_absolute() else self.content / f"{name}.usda"

    def run(self, jobs):
        """Measures {key: Job}, but for those that are in the store; returns {key: Result}."""
        bar = progress.Progress(self.settings.progress, [job.weight for job in jobs.values()])
        results = {}
        try:
            for key, job in jobs.items():
                bar.show(job.name())
                what, watch = self._identity(job), progress.Watch()
                known = self.store.get(what)
                if known is None:
                    numbers, arrays = getattr(measure, job.kind)(self, **job.arguments)
                    self.store.put(what, numbers, arrays)
                bar.step(None if known else watch.seconds())
                results[key] = Result(job, *(known or (numbers, arrays)))
        finally:
            bar.close()
        return results

    def _identity(self, job):
        arguments = dict(job.arguments)
        if "stage" in arguments:
            path = self.stage(arguments["stage"])
            arguments["stage"] = [path.stem, hashlib.sha256(path.read_bytes()).hexdigest()]
        return {"kind": job.kind, **arguments}

    def facts(self, results):
        """What results.json says of the run and of every sample."""
        s = self.settings
        import matplotlib

        return {
            "suite": s.suite, "written": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            "device": self.device(), "tracer": s.tracer, "cpus": cpus(), "machine": platform.machine(),
            "versions": {"trilume": self.info["version"], "python": platform.python_version(), "numpy": np.__version__,
                         "matplotlib": matplotlib.__version__},
            "flags": {"quick": s.quick, "seed": s.seed, "repeats": s.repeats, "techniques": s.techniques, "stages": s.stages},
            "samples": [{"kind": r.job.kind, **{k: str(v) if isinstance(v, Path) else v for k, v in r.job.arguments.items()},
                         **r.numbers} for r in results.values()],
        }

    def device(self):
        chosen = self.settings.device
        devices = [d for d in self.info["devices"] if d["usable"]]
        order = ["discrete", "integrated", "virtual", "cpu"]
        named = [d for d in devices if chosen in (str(d["index"]), d["name"])]
        found = named or sorted(devices, key=lambda d: order.index(d["type"]) if d["type"] in order else len(order))
        return {key: found[0][key] for key in ("name", "driver", "type")} if found else {}


def cpus():
    return len(os.sched_getaffinity(0))
