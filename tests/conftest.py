import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE / "references", HERE / "image", HERE.parent / "editor" / "bench"):
    sys.path.insert(0, str(folder))

import harness  # noqa: E402


@pytest.fixture(scope="session")
def command():
    """Path of the built `trilume` command."""
    harness.require_command()
    return harness.COMMAND


@pytest.fixture(scope="session")
def render(command, tmp_path_factory):
    """A harness.Renderer."""
    return harness.Renderer(tmp_path_factory.mktemp("render"))
