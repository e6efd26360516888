"""`trilume bench` from end to end on the smallest run there is; what it measures is tested by the measures' own tests."""

import json
import re
import shutil
import time

import pytest

import harness

TINY = ("bench", "paper", "--quick", "--stage", "one_box", "-t", "raytrace", "-t", "restir")


@pytest.fixture(scope="module")
def output(command, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    result = harness.run(*TINY, "-o", folder)
    assert result.status == 0, result.stderr
    return folder


def test_report_shows_what_was_measured(output):
    text = (output / "report.md").read_text()
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert {"figure05_time.png", "figure06_darkening.png", "figure11_mse.png", "pictures.png"} <= set(pictures)
    for picture in pictures:
        assert (output / picture).stat().st_size > 1000
    assert "## Targets" in text and "`restir`" in text


def test_results_hold_every_sample(output):
    facts = json.loads((output / "results.json").read_text())
    assert facts["device"]["name"] and facts["versions"]["trilume"] and facts["flags"]["quick"]
    frames = [s for s in facts["samples"] if s["kind"] == "frames"]
    # one_box, five_boxes, and five_boxes uncompensated
    assert len(frames) == 6 and all(len(s["ms"]) > s["warmup"] and s["nonfinite"] == 0 for s in frames)


def test_darkening_is_the_papers_where_the_division_is_left_out(output):
    kept = json.loads((output / "results.json").read_text())["summary"]["darkening"]["raytrace"]
    assert kept[1] == pytest.approx(1, abs=0.05) and kept[2] == pytest.approx(0.2, abs=0.03)


def test_a_second_run_measures_only_what_is_new(output):
    before = {p.name: p.stat().st_mtime_ns for p in (output / "samples").iterdir()}
    (output / "report.md").unlink()
    result = harness.run(*TINY, "-o", output)
    assert result.status == 0 and (output / "report.md").exists()
    assert {p.name: p.stat().st_mtime_ns for p in (output / "samples").iterdir()} == before
    damaged = sorted((output / "samples").glob("*.npz"))[0]
    damaged.write_bytes(damaged.read_bytes()[:100])
    assert harness.run(*TINY, "-o", output).status == 0
    assert {p.name for p in (output / "samples").iterdir()} == set(before)
    assert damaged.stat().st_mtime_ns != before[damaged.name] and damaged.stat().st_size > 100


def test_stability_catches_what_a_shader_does_wrong(command, tmp_path):
    """A leak of 2% and a pixel that is not a number, planted where the path classes are summed."""
    shaders = shutil.copytree(harness.ROOT / "shaders", tmp_path / "shaders")
    composite = shaders / "passes/composite/composite.comp"
    text, summed = composite.read_text(), "    if (!isFinite(color)) {"
    assert summed in text
    composite.write_text(text.replace(summed, "    color *= index == 77u ? log(-color - 1.0) : vec3(0.98);\n" + summed))
    words = ("bench", "stability", "--quick", "--stage", "furnace, IOR 3", "-t", "reference", "-o", tmp_path / "out")
    for env, failed in (({}, set()), ({"TRILUME_SHADERS": str(shaders)}, {"1 +- 0.005", "0 values that are not finite"})):
        result = harness.run(*words, env=env)
        assert result.status == 0, result.stderr
        checks = json.loads((tmp_path / "out" / "results.json").read_text())["summary"]["checks"]
        assert {c["bound"] for c in checks if not c["good"]} == failed
        assert ("What fails" in (tmp_path / "out" / "report.md").read_text()) == bool(failed)


def test_interrupted_run_leaves_what_it_measured(command, tmp_path):
    """Ctrl-C: one line, exit status 1, no process left behind, and the samples so far."""
    process = harness.start(*TINY, "-o", tmp_path)
    while process.poll() is None and len(list((tmp_path / "samples").glob("*.json"))) < 2:
        time.sleep(0.05)
    status, stderr = harness.interrupt(process)
    assert status == 1 and stderr.startswith("trilume: error: interrupted: ") and stderr.count("\n") == 1
    assert 2 <= len(list((tmp_path / "samples").glob("*.json"))) < 7
    assert not list((tmp_path / "samples").glob(".*")) and not (tmp_path / "report.md").exists()


@pytest.mark.parametrize("words, place", [
    (("bench", "paper"), "trilume bench"),
    (("bench", "nothing", "-o", "out"), "trilume bench"),
    (("bench", "paper", "-o", "/proc/nowhere"), "/proc/nowhere"),
    (("bench", "paper", "-o", "out", "--stage", "nowhere"), "--stage nowhere"),
    (("bench", "paper", "-o", "out", "-t", "nothing"), "--technique nothing"),
])
def test_bad_command_line(command, tmp_path, words, place):
    result = harness.run(*words, cwd=tmp_path)
    assert result.status == 2 and len(result.errors) == 1
    assert harness.ERROR_LINE.fullmatch(result.errors[0]) and place in result.errors[0]


def test_missing_package_is_named(command, tmp_path):
    (tmp_path / "matplotlib.py").write_text('raise ModuleNotFoundError("no", name="matplotlib")\n')
    result = harness.run("bench", "paper", "-o", tmp_path, env={"PYTHONPATH": str(tmp_path)})
    assert result.status == 2 and "Python package missing: matplotlib: " in result.stderr


def test_missing_interpreter_is_named(command, tmp_path):
    result = harness.run("bench", "paper", "-o", tmp_path, env={"TRILUME_PYTHON": str(tmp_path / "python3")})
    assert result.status == 2 and harness.ERROR_LINE.search(result.stderr)
