import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE / "references", HERE / "image", HERE.parent / "editor" / "bench"):
    sys.path.insert(0, str(folder))

import harness  # noqa: E402
import report  # noqa: E402


def pytest_configure():
    if "PYTEST_XDIST_WORKER" not in os.environ:
        report.clear()


@pytest.fixture(scope="session")
def command():
    """Path of the built `trilume` command."""
    harness.require_command()
    return harness.COMMAND


@pytest.fixture(scope="session")
def render(command, tmp_path_factory):
    """A harness.Renderer, whose folder all processes of this run share."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "renders"
    folder.mkdir(exist_ok=True)
    return harness.Renderer(folder)
