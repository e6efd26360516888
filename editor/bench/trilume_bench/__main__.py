"""What `trilume bench` runs; the command checks and completes the arguments."""

import argparse
import importlib
import json
import sys
import traceback
from pathlib import Path

from .errors import INPUT, RUN, BenchError, print_error


def parse(words):
    parser = argparse.ArgumentParser(prog="trilume bench")
    parser.add_argument("suite")
    for name in ("--home", "--command", "--output"):
        parser.add_argument(name, type=Path, required=True)
    parser.add_argument("--quick", action="store_true")
    for name in ("--seed", "--repeats"):
        parser.add_argument(name, type=int, default=0)
    for name in ("--device", "--tracer", "--progress"):
        parser.add_argument(name, default="auto")
    for name in ("--technique", "--stage"):
        parser.add_argument(name, action="append", default=[])
    return parser.parse_args(words)


def prepare(folder):
    """Creates the output folder, and finds out whether it can be written before the time to measure is spent."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".trilume-bench"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise BenchError(INPUT, "cannot write to the output folder", folder, f"{error.strerror}: choose another -o") from None


def run(words):
    options = parse(words)
    prepare(options.output)
    try:
        from . import bench, report, store
        suite = importlib.import_module(f"trilume_bench.suites.{options.suite}")
    except ModuleNotFoundError as error:
        raise BenchError(INPUT, "Python package missing", error.name, "run tools/bootstrap --bench") from None
    settings = bench.Settings(options.suite, options.home, options.command, options.output.resolve(), options.quick,
                              options.seed, options.repeats, options.device, options.tracer, tuple(options.technique),
                              tuple(options.stage), options.progress)
    this = bench.Bench(settings)
    try:
        results = this.run(suite.jobs(this))
    except KeyboardInterrupt:
        raise BenchError(RUN, "interrupted", options.output, "what was measured is kept: the same command goes on") from None
    device, quick = this.device(), ", quick" if options.quick else ""
    page = report.Page(options.output, f"trilume bench {options.suite}{quick}")
    page.text(f"{device.get('name', 'no device')}, {device.get('driver', '')}; {bench.cpus()} CPU cores; "
              f"trilume {this.info['version']}. Every sample is in results.json.")
    facts = this.facts(results)
    facts["summary"] = suite.report(this, page, results)
    store.write_text(options.output / "results.json", json.dumps(facts, indent=1, default=lambda number: number.item()) + "\n")
    page.write()
    print(options.output / "report.md")


def main():
    try:
        run(sys.argv[1:])
    except BenchError as error:
        print_error(error, sys.stderr)
        sys.exit(error.fault)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        print_error(f"unexpected failure ({type(error).__name__}: {error}): {where.filename}:{where.lineno}: please report this",
                    sys.stderr)
        sys.exit(RUN)


main()
