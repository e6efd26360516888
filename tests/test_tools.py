"""tools/test as a command."""

import subprocess

import harness


def test_unknown_kind_of_test_is_refused():
    done = subprocess.run([harness.ROOT / "tools/test", "untis"], capture_output=True, text=True)
    assert done.returncode == 2 and "untis" in done.stderr and done.stdout == ""
