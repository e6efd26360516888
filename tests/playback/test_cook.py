"""Cooked scenes: the stage's picture bit for bit, without what reads stages; bad files are declined."""

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import harness
from harness import CONTENT, LAMP, SMALL, matte, mesh, write_stage
from trilume_bench import metrics

STAGES = sorted(path.stem for path in CONTENT.glob("*.usda"))

# Everything that may vary with time, in stages of a centimetre a unit and with a turned axis. Samples lie between frames,
# too; what is not linear between them is meant.
VARYING = """#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
    startTimeCode = 1
    endTimeCode = 5
)
def Camera "Camera"
{
    float focalLength.timeSamples = { 1: 20, 4: 30 }
    double3 xformOp:translate = (0, -400, 50)
    float xformOp:rotateX = 85
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}
def SphereLight "Lamp"
{
    float inputs:radius = 20
    float inputs:intensity.timeSamples = { 1: 20, 5: 60 }
    float inputs:exposure.timeSamples = { 1: 0, 5: 1 }
    double3 xformOp:translate.timeSamples = { 1: (-100, -200, 300), 2.5: (100, -200, 300), 5: (0, -200, 300) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Arm"
{
    float xformOp:rotateZ.timeSamples = { 1: 0, 5: 300 }
    uniform token[] xformOpOrder = ["xformOp:rotateZ"]
    def Cube "Hand" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double size = 40
        rel material:binding = </Paint>
        token visibility.timeSamples = { 1: "inherited", 3: "invisible", 4: "inherited" }
        double3 xformOp:translate = (100, 0, 30)
        float3 xformOp:rotateXYZ.timeSamples = { 1: (0, 0, 0), 5: (90, 200, -300) }
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    }
}
def Mesh "Cloth"
{
    point3f[] points.timeSamples = {
        1: [(-150, -150, 0), (150, -150, 0), (150, 150, 0), (-150, 150, 0), (0, 0, 10)],
        5: [(-150, -150, 0), (150, -150, 20), (150, 150, 0), (-150, 150, 40), (30, 0, 90)],
    }
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]
}
def Sphere "Ball"
{
    double radius.timeSamples = { 1: 10, 2: 30, 3: 0, 5: 30 }
    double3 xformOp:translate = (-90, -60, 60)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def PointInstancer "Flakes"
{
    rel prototypes = [</Flakes/Flake>]
    int[] protoIndices.timeSamples = { 1: [0, 0], 3: [0, 0, 0, 0] }
    point3f[] positions.timeSamples = { 1: [(-50, 0, 50), (50, 0, 50)], 3: [(-50, 0, 80), (50, 0, 80), (0, 0, 90), (0, 50, 99)] }
    def Cone "Flake"
    {
        double radius = 10
        double height = 20
    }
}
def Material "Paint"
{
    token outputs:surface.connect = </Paint/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.timeSamples = { 1: (1, 0, 0), 5: (0, 0.5, 1) }
        float inputs:roughness.timeSamples = { 1: 0.1, 5: 0.6 }
        token outputs:surface
    }
}
"""


def cook(stage, output, *options):
    done = harness.run("cook", *options, stage, output)
    assert done.status == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def cooked(command, tmp_path_factory):
    """Path of a content stage, cooked."""
    folder, known = tmp_path_factory.mktemp("cooked"), {}

    def once(name):
        if name not in known:
            known[name] = folder / f"{name}.tlscene"
            cook(harness.find_stage(name), known[name])
        return known[name]

    return once


@pytest.fixture(scope="module")
def varying(command, tmp_path_factory):
    """(stage, the same cooked)"""
    folder = tmp_path_factory.mktemp("varying")
    (folder / "stage.usda").write_text(VARYING)
    cook(folder / "stage.usda", folder / "stage.tlscene")
    return folder / "stage.usda", folder / "stage.tlscene"


@pytest.mark.parametrize("name", STAGES)
def test_a_cooked_stage_gives_the_same_picture(render, cooked, name):
    options = ("-t", "pathtrace", "--spp", 2)
    assert (render(name, *options, size=SMALL).image == render(cooked(name), *options, size=SMALL).image).all()


@pytest.mark.parametrize("technique", ["hybrid", "reference"])
def test_every_node_sees_the_same(render, cooked, technique):
    """With histories, probes and photons, which depend on the order of lights and instances."""
    pictures = [render(stage, "-t", technique, "--warmup", 3, size=SMALL) for stage in ("cornell_glass", cooked("cornell_glass"))]
    assert (pictures[0].image == pictures[1].image).all()
    assert pictures[0].stats["frames"][0]["accel"]["blas_built"] > 0
    assert pictures[1].stats["frames"][0]["accel"]["blas_built"] == 0, "they come with the file"


def played(stage, folder, spec):
    """One run over several frames."""
    width, height = SMALL
    folder.mkdir()
    done = harness.run("render", "-t", "pathtrace", "--imageWidth", width, "--imageHeight", height, "-f", spec, stage,
                       folder / "####.##.pfm")
    assert done.status == 0, done.stderr
    return [metrics.read_image(path) for path in sorted(folder.iterdir())]


@pytest.mark.parametrize("name, spec", [("animated", "1,7,12,24"), ("varying", "1:5,2.5,0,9")])
def test_frames_and_samples_are_exact(cooked, varying, tmp_path, name, spec):
    stage, scene = varying if name == "varying" else (harness.find_stage(name), cooked(name))
    expected, found = played(stage, tmp_path / "stage", spec), played(scene, tmp_path / "cooked", spec)
    assert len(found) == len(expected) > 3
    assert all((a == b).all() for a, b in zip(expected, found))
    assert all((a != b).any() for a, b in zip(found, found[1:])), "something moves"


@pytest.mark.parametrize("name, spec", [("animated", "1.4,7.3,16.85"), ("varying", "1.3,2.2,3.4,4.7")])
def test_between_samples_pictures_are_close(render, cooked, varying, tmp_path, name, spec):
    """Values are off by about a thousandth of their change from frame to frame: with the same random numbers, few pixels
    differ, at edges. A frame apart, relMSE is above 0.01."""
    stage, scene = varying if name == "varying" else (harness.find_stage(name), cooked(name))
    expected, found = played(stage, tmp_path / "stage", spec), played(scene, tmp_path / "cooked", spec)
    for a, b in zip(expected, found):
        assert np.mean(np.abs(a - b) > 0.01 * (a + 0.01)) < 0.05
        assert b.mean() == pytest.approx(a.mean(), rel=0.01)


def test_frames_restrict_what_is_baked(render, tmp_path, varying):
    stage, whole = varying
    cook(stage, tmp_path / "part.tlscene", "-f", "2:3")
    options = ("-t", "pathtrace")
    first = render(tmp_path / "part.tlscene", *options, size=SMALL).image
    assert (first == render(whole, *options, "-f", 2, size=SMALL).image).all(), "its start is the first of them"
    last = render(tmp_path / "part.tlscene", *options, "-f", 3, size=SMALL).image
    assert (last == render(whole, *options, "-f", 3, size=SMALL).image).all()
    assert (tmp_path / "part.tlscene").stat().st_size < whole.stat().st_size
    late = render(tmp_path / "part.tlscene", *options, "-f", "4", size=SMALL)
    assert "time 4 is outside what was cooked" in late.stderr
    assert late.stderr.count("warning") == 1


def test_textures_are_inside(render, tmp_path):
    import OpenImageIO as oiio
    pixels = np.random.default_rng(1).random((8, 8, 3), np.float32)
    oiio.ImageBuf(pixels).write(str(tmp_path / "image.exr"))
    lamp = LAMP.replace("SphereLight", "DomeLight").replace("float inputs:radius = 0.3", "asset inputs:texture:file = @./image.exr@")
    stage = write_stage(tmp_path / "stage.usda", harness.CAMERA, lamp, matte(), mesh())
    cook(stage, tmp_path / "stage.tlscene")
    expected = render(stage, "-t", "pathtrace", size=SMALL).image
    (tmp_path / "image.exr").unlink()
    assert (render(tmp_path / "stage.tlscene", "-t", "pathtrace", size=SMALL).image == expected).all()


def test_equal_stages_give_equal_bytes(cooked, varying, tmp_path):
    for stage, scene in (varying, (harness.find_stage("animated"), cooked("animated"))):
        cook(stage, tmp_path / "again.tlscene")
        assert (tmp_path / "again.tlscene").read_bytes() == scene.read_bytes()
    cook(cooked("maze"), tmp_path / "twice.tlscene")
    assert (tmp_path / "twice.tlscene").read_bytes() == cooked("maze").read_bytes()


def test_neither_python_nor_openimageio_is_loaded(cooked, tmp_path):
    """Cooked scene in, .pfm out: what the dynamic linker loads are the nodes, the engine, and the driver. And it runs from
    an installation that has nothing else."""
    home = tmp_path / "home"
    plugins = home / "lib" / "trilume" / "plugins"
    plugins.mkdir(parents=True)
    (home / "share").symlink_to(harness.BUILD / "share")
    for plugin in (harness.BUILD / "lib" / "trilume" / "plugins").iterdir():
        if plugin.name not in ("usd_stage", "image_io", "oidn"):
            (plugins / plugin.name).symlink_to(plugin)
    width, height = SMALL
    done = harness.run("render", "--imageWidth", width, "--imageHeight", height, cooked("cornell_glass"), tmp_path / "a.pfm",
                       env={"TRILUME_HOME": str(home), "LD_DEBUG": "files", "LD_DEBUG_OUTPUT": str(tmp_path / "linker")})
    assert done.status == 0, done.stderr
    (log,) = tmp_path.glob("linker.*")
    loaded = {Path(line.split()[-1]).name for line in log.read_text().splitlines() if "calling init:" in line}
    assert "visibility.so" in loaded and any(name.startswith("libvulkan.so") for name in loaded)
    assert not [name for name in loaded if re.search("python|OpenImageIO|usd_stage|image_io", name)]


def test_what_the_reader_leaves_out_is_said_while_cooking(tmp_path, command):
    stage = write_stage(tmp_path / "stage.usda", LAMP, matte(), mesh(), 'def BasisCurves "Hair" {}\n')
    assert "/World/Hair" in cook(stage, tmp_path / "stage.tlscene").stderr


# ---- what can't be ------------------------------------------------------------------------------

def declined(done, *mentions):
    errors = [line for line in done.stderr.splitlines() if line.startswith("trilume: error:")]
    assert done.status == 2 and len(errors) == 1, done.stderr
    assert harness.ERROR_LINE.fullmatch(errors[0]), errors[0]
    assert all(mention in errors[0] for mention in mentions), errors[0]
    return True


def flipped(bytes_, at):
    return bytes_[:at] + bytes([bytes_[at] ^ 4]) + bytes_[at + 1:]


@pytest.mark.parametrize("damage, mention", [
    (lambda b: b"", "empty"),
    (lambda b: b"#usda 1.0\n" + b[10:], "not a .tlscene file"),
    (lambda b: b[:4], "not a .tlscene file"),
    (lambda b: b[:100], "damaged"),
    (lambda b: b[:-64], "damaged"),
    (lambda b: b + bytes(64), "damaged"),
    (lambda b: flipped(b, len(b) // 2), "damaged"),
    (lambda b: flipped(b, len(b) - 1), "damaged"),
    (lambda b: b[:12] + b"\0\0\0\0" + b[16:], "format 0"),
    (lambda b: b[:12] + b"\xff\0\0\0" + b[16:], "format 255"),
    (lambda b: b[:8] + b[8:12][::-1] + b[12:], "byte order"),
], ids=["empty", "text", "4 bytes", "header alone", "cut", "longer", "bit in the middle", "last bit", "older", "newer",
        "byte order"])
def test_bad_file(cooked, tmp_path, damage, mention):
    bad = tmp_path / "bad.tlscene"
    bad.write_bytes(damage(cooked("one_box").read_bytes()))
    assert declined(harness.run("render", bad, tmp_path / "a.pfm"), "bad.tlscene", mention)
    assert not (tmp_path / "a.pfm").exists()


def test_a_folder_is_no_scene(command, tmp_path):
    (tmp_path / "folder.tlscene").mkdir()
    assert declined(harness.run("render", tmp_path / "folder.tlscene", tmp_path / "a.pfm"), "folder.tlscene")


def test_a_pipe_is_no_scene(command, tmp_path):
    """Waiting for a writer would be forever."""
    os.mkfifo(tmp_path / "pipe.tlscene")
    done = harness.run("render", tmp_path / "pipe.tlscene", tmp_path / "a.pfm", timeout=60)
    assert declined(done, "pipe.tlscene")


def test_info_lists_the_formats(command):
    info = json.loads(subprocess.run([command, "info", "--json"], capture_output=True, check=True).stdout)
    assert {".tlscene", ".usda", ".usdz"} <= set(info["scene_formats"])
    assert {".pfm", ".exr", ".png"} <= set(info["image_formats"])


@pytest.mark.parametrize("arguments, mention", [
    (("maze.usda", "out.usda"), "out.usda"),
    (("maze.usda", "no/folder/out.tlscene"), "no/folder"),
    (("nowhere.usda", "out.tlscene"), "nowhere.usda"),
    (("maze.usda", "out.tlscene", "-f", "1:x"), "1:x"),
    (("maze.usda",), "OUTPUT"),
    (("maze.usda", "out.tlscene", "--spp", "3"), "--spp"),
], ids=str)
def test_bad_cook_command(command, tmp_path, arguments, mention):
    done = harness.run("cook", *(CONTENT / a if a == "maze.usda" else a for a in arguments), cwd=tmp_path)
    assert declined(done, mention)
    assert not list(tmp_path.iterdir())


def test_endless_stage(command, tmp_path):
    stage = tmp_path / "stage.usda"
    stage.write_text(VARYING.replace("5: 300", "1e9: 300"))
    assert declined(harness.run("cook", stage, tmp_path / "out.tlscene"), "--frames")
    assert not (tmp_path / "out.tlscene").exists()
