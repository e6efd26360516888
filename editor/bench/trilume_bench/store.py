"""Measurements on disk, each by itself, so that an interrupted run goes on where it stopped."""

import hashlib
import json
import os
import tempfile
import zipfile
import zlib
from pathlib import Path

import numpy as np

FORMAT = 1


def write_atomically(path, write):
    """Calls `write(file)` with a binary file beside `path`, then renames it."""
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".", suffix=path.suffix, delete=False) as file:
        try:
            write(file)
            file.close()
            os.chmod(file.name, 0o644)
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise


def write_text(path, text):
    write_atomically(Path(path), lambda file: file.write(text.encode()))


def fingerprint(paths):
    """A checksum over files, and over all files in folders."""
    digest = hashlib.sha256()
    for path in paths:
        path = Path(path)
        for file in sorted(p for p in path.rglob("*") if p.is_file() and p.suffix != ".pyc") if path.is_dir() else [path]:
            digest.update(f"{file.name}\0".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


class Store:
    """Numbers (JSON) and arrays of measurements, found by what was measured and by `build`, a checksum of what measured."""

    def __init__(self, folder, build):
        self.folder, self.build = Path(folder), build
        self.folder.mkdir(parents=True, exist_ok=True)

    def get(self, what):
        """(numbers, arrays) or None."""
        facts, arrays = self._paths(what)
        try:
            numbers = json.loads(facts.read_text())["numbers"]
            with np.load(arrays) as data:
                return numbers, dict(data)
        except (OSError, ValueError, KeyError, zipfile.BadZipFile, zlib.error):  # missing, or damaged
            return None

    def put(self, what, numbers, arrays):
        facts, data = self._paths(what)
        write_atomically(data, lambda file: np.savez_compressed(file, **arrays))
        write_text(facts, json.dumps({"what": what, "numbers": numbers}, indent=1))

    def _paths(self, what):
        key = hashlib.sha256(json.dumps([FORMAT, self.build, what], sort_keys=True).encode()).hexdigest()[:24]
        return self.folder / f"{key}.json", self.folder / f"{key}.npz"
