"""Bad commands and bad stages: exit status 2 and one clear line, or a warning and a picture; never a crash, never a
silent black image, nothing half-written."""

import os
import re
import stat

import numpy as np
import pytest
from pxr import Sdf

import harness
from trilume_bench import metrics
from harness import CAMERA, CONTENT, LAMP, SQUARE_POINTS, matte, mesh, write_stage

GOOD = CONTENT / "cornell_empty.usda"
SMALL = ("--imageWidth", 32, "--imageHeight", 18)


def attempt(folder, stage, *options, output=None):
    """(run, output path): the run's own output folder is empty before."""
    (folder / "out").mkdir()
    output = output or folder / "out" / "image.pfm"
    technique = () if "-t" in options else ("-t", "pathtrace")
    return harness.run("render", *SMALL, *technique, *options, stage, output, timeout=120), output


def assert_declined(run, folder, *mentions):
    """Exit status 2; one line `trilume: error: WHAT: WHERE: what to do`, which mentions what is wrong."""
    assert run.status == 2, run.stderr
    errors = [line for line in run.stderr.splitlines() if line.startswith("trilume: error:")]
    assert len(errors) == 1, run.stderr
    assert harness.ERROR_LINE.fullmatch(errors[0]), errors[0]
    for mention in mentions:
        assert mention in errors[0], errors[0]
    assert no_noise(run.stderr), run.stderr
    assert list((folder / "out").iterdir()) == []


def assert_shown(run, output, warning=None, dark=False):
    """Exit status 0, a finite picture that is not black, and a warning that says what was left out."""
    assert run.status == 0, run.stderr
    image = metrics.read_image(output)
    assert image.shape == (18, 32, 3) and np.isfinite(image).all()
    assert dark or image.mean() > 0
    assert [p.name for p in output.parent.iterdir()] == [output.name]
    assert no_noise(run.stderr), run.stderr
    if warning:
        warnings = [line for line in run.stderr.splitlines() if "warning" in line]
        assert any(re.search(warning, line) for line in warnings), run.stderr


def no_noise(stderr):
    """No stack traces, no sanitizer reports, no messages of libraries."""
    return not re.search(r"Traceback|Sanitizer|Segmentation|terminate called|^\s+File \"|TF_|Tf\.Error", stderr, re.M)


# ---- files that are no stages ------------------------------------------------------------------

def test_missing_file(command, tmp_path):
    assert_declined(attempt(tmp_path, tmp_path / "nowhere.usda")[0], tmp_path, "nowhere.usda")


def test_directory(command, tmp_path):
    assert_declined(attempt(tmp_path, tmp_path)[0], tmp_path, str(tmp_path))


def test_directory_with_a_stage_s_name(command, tmp_path):
    (tmp_path / "folder.usda").mkdir()
    assert_declined(attempt(tmp_path, tmp_path / "folder.usda")[0], tmp_path, "folder.usda")


@pytest.mark.parametrize("extension", ["usda", "usdc", "usd", "usdz", "tlscene"])
def test_empty_file(command, tmp_path, extension):
    stage = tmp_path / f"empty.{extension}"
    stage.touch()
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, stage.name)


@pytest.mark.parametrize("share", [0.02, 0.5, 0.97])
def test_truncated_usdc(command, tmp_path, share):
    whole = tmp_path / "whole.usdc"
    layer = Sdf.Layer.FindOrOpen(str(GOOD))
    layer.Export(str(whole))
    stage = tmp_path / "cut.usdc"
    stage.write_bytes(whole.read_bytes()[:int(whole.stat().st_size * share)])
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, "cut.usdc")


def test_text_named_usda(command, tmp_path):
    stage = tmp_path / "letter.usda"
    stage.write_text("Dear reader,\nthis is not a stage.\n")
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, "letter.usda")


def test_syntax_error_in_usda(command, tmp_path):
    stage = tmp_path / "broken.usda"
    stage.write_text(GOOD.read_text()[:1500])
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, "broken.usda")


def test_unknown_extension(command, tmp_path):
    stage = tmp_path / "model.obj"
    stage.write_text("v 0 0 0\n")
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, "model.obj")


# ---- stages that lack something ----------------------------------------------------------------

def test_no_geometry(command, tmp_path):
    stage = write_stage(tmp_path / "stage.usda", CAMERA)
    assert_declined(attempt(tmp_path, stage)[0], tmp_path, "stage.usda")


def test_no_camera_frames_the_bounds(command, tmp_path):
    stage = write_stage(tmp_path / "stage.usda", mesh(), matte(), LAMP)
    assert_shown(*attempt(tmp_path, stage))


def test_no_lights_gets_a_dome(command, tmp_path):
    """A neutral dome of radiance 1, said in one line; the background shows it."""
    stage = write_stage(tmp_path / "stage.usda", CAMERA, mesh(), matte())
    run, output = attempt(tmp_path, stage)
    assert_shown(run, output)
    assert len([line for line in run.stderr.splitlines() if "dome" in line]) == 1, run.stderr
    assert metrics.read_image(output)[0, 0] == pytest.approx(1)


def test_no_lights_and_no_default_light_is_black(command, tmp_path):
    stage = write_stage(tmp_path / "stage.usda", CAMERA, mesh(), matte())
    run, output = attempt(tmp_path, stage, "--default-light", "off")
    assert_shown(run, output, dark=True)
    assert (metrics.read_image(output) == 0).all()


def test_missing_texture(command, tmp_path):
    stage = write_stage(tmp_path / "stage.usda", CAMERA, mesh(), LAMP, textured("nowhere.png"))
    assert_shown(*attempt(tmp_path, stage), warning="nowhere.png")


def test_texture_that_does_not_decode(command, tmp_path):
    (tmp_path / "bad.png").write_bytes(b"\x89PNG\r\n\x1a\nnothing of the kind")
    stage = write_stage(tmp_path / "stage.usda", CAMERA, mesh(), LAMP, textured("bad.png"))
    assert_shown(*attempt(tmp_path, stage), warning="bad.png")


def textured(file):
    return matte().replace("color3f inputs:diffuseColor = (0.8, 0.8, 0.8)",
                           "color3f inputs:diffuseColor.connect = </World/Matte/Texture.outputs:rgb>").rstrip()[:-1] + f"""
        def Shader "Texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./{file}@
            float3 outputs:rgb
        }}
    }}
"""


# ---- geometry that can't be ---------------------------------------------------------------------

OTHER = mesh("[(-3, -1, -1), (-2, -1, -1), (-2, 1, -1), (-3, 1, -1)]", name="Other")


def broken_stage(tmp_path, *parts):
    """Beside the broken mesh a good one, which must still be seen."""
    return write_stage(tmp_path / "stage.usda", CAMERA, LAMP, matte(), OTHER, *parts)


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf"])
def test_points_that_are_no_numbers(command, tmp_path, bad):
    stage = broken_stage(tmp_path, mesh(SQUARE_POINTS.replace("(1, 1, 0)", f"(1, {bad}, 0)")))
    assert_shown(*attempt(tmp_path, stage), warning="/World/Square")


@pytest.mark.parametrize("indices", ["[0, 1, 2, 4]", "[0, 1, -1, 3]", "[0, 1, 2, 2000000000]"])
def test_indices_out_of_range(command, tmp_path, indices):
    assert_shown(*attempt(tmp_path, broken_stage(tmp_path, mesh(indices=indices))), warning="/World/Square")


@pytest.mark.parametrize("counts, indices", [("[5]", "[0, 1, 2, 3]"), ("[4]", "[0, 1, 2, 3, 0]"), ("[2]", "[0, 1]"),
                                             ("[-3]", "[0, 1, 2]")])
def test_counts_that_do_not_match(command, tmp_path, counts, indices):
    stage = broken_stage(tmp_path, mesh(counts=counts, indices=indices))
    assert_shown(*attempt(tmp_path, stage), warning="/World/Square")


def test_zero_area_triangles(command, tmp_path):
    """A needle, a point and a good square in one mesh: the square is seen."""
    points = SQUARE_POINTS[:-1] + ", (0, 0, 0), (0, 1, 0), (0, 2, 0)]"
    whole = write_stage(tmp_path / "whole.usda", CAMERA, LAMP, matte(), mesh())
    broken = write_stage(tmp_path / "broken.usda", CAMERA, LAMP, matte(),
                         mesh(points, "[4, 3, 3, 4]", "[0, 1, 2, 3, 4, 5, 6, 4, 4, 4, 0, 0, 1, 1]"))
    images = []
    for stage in (whole, broken):
        run, output = attempt(tmp_path, stage, "--spp", 64)
        assert_shown(run, output)
        images.append(metrics.read_image(output))
        output.unlink()
        output.parent.rmdir()
    assert images[1].mean() == pytest.approx(images[0].mean(), rel=0.02)


def test_only_zero_area_triangles(command, tmp_path):
    stage = write_stage(tmp_path / "stage.usda", CAMERA, LAMP, matte(), mesh("[(0, 0, 0), (0, 0, 0), (0, 0, 0)]", "[3]", "[0, 1, 2]"))
    run, output = attempt(tmp_path, stage)
    if run.status == 2:
        assert_declined(run, tmp_path, "stage.usda")
    else:
        assert_shown(run, output, dark=True)


@pytest.mark.parametrize("radius", ["0", "nan", "-1"])
def test_light_without_extent(command, tmp_path, radius):
    """A second, impossible lamp: the first still shines, and no pixel is spoilt."""
    second = LAMP.replace('"Lamp"', '"Second"').replace("radius = 0.3", f"radius = {radius}")
    stage = write_stage(tmp_path / "stage.usda", CAMERA, LAMP, second, matte(), mesh())
    assert_shown(*attempt(tmp_path, stage))


def test_scale_zero(command, tmp_path):
    flat = mesh(extra='float3 xformOp:scale = (0, 0, 0)\n        uniform token[] xformOpOrder = ["xformOp:scale"]')
    assert_shown(*attempt(tmp_path, broken_stage(tmp_path, flat)))


def test_unsupported_prim_is_named_once(command, tmp_path):
    curves = """
    def BasisCurves "Hair"
    {
        int[] curveVertexCounts = [4]
        point3f[] points = [(0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0)]
        float[] widths = [0.1]
    }
"""
    run, output = attempt(tmp_path, broken_stage(tmp_path, mesh(), curves))
    assert_shown(run, output, warning="/World/Hair")
    assert run.stderr.count("/World/Hair") == 1


# ---- commands that can't be ---------------------------------------------------------------------

@pytest.mark.parametrize("options, mentions", [
    (("-t", "sorcery"), ("sorcery", "pathtrace")),
    (("--camera", "Nobody"), ("Nobody", "Camera")),
    (("--device", "99"), ("99",)),
    (("--device", "No such device"), ("No such device",)),
    (("--tracer", "guess"), ("guess",)),
    (("--set", "pathtrace.bounces=3"), ("pathtrace.bounces",)),
    (("--set", "nothing.at.all=3"), ("nothing.at.all",)),
    (("--set", "pathtrace.nee=perhaps"), ("pathtrace.nee", "perhaps")),
    (("--set", "pathtrace.nee"), ("pathtrace.nee",)),
    (("--enable", "sorcery"), ("sorcery",)),
    (("--disable", "sorcery"), ("sorcery",)),
    (("--spp", "0"), ("spp",)),
    (("--spp", "many"), ("many",)),
    (("--time", "-1"), ("time",)),
    (("--frames", "1:x"), ("1:x",)),
    (("--frames", "1:5x0"), ("1:5x0",)),
    (("--imageWidth", "0"), ("imageWidth",)),
    (("--imageWidth", "1000000"), ("1000000",)),
    (("--seed", "-x"), ("-x",)),
    (("--nonsense",), ("--nonsense",)),
    (("--aov", "soul=soul.pfm"), ("soul",)),
], ids=lambda value: "=".join(value) if isinstance(value, tuple) else None)
def test_option(command, tmp_path, options, mentions):
    assert_declined(attempt(tmp_path, GOOD, *options)[0], tmp_path, *mentions)


def test_several_frames_need_a_pattern(command, tmp_path):
    assert_declined(attempt(tmp_path, CONTENT / "animated.usda", "-f", "1:2")[0], tmp_path, "#")


@pytest.mark.parametrize("output", ["no/such/folder/image.pfm", "image.tiff3", "image", "folder.pfm"])
def test_unwritable_output(command, tmp_path, output):
    """Declined before any rendering: with a million samples this would not end in time."""
    (tmp_path / "folder.pfm").mkdir()
    run, _ = attempt(tmp_path, GOOD, "--spp", 1000000, output=tmp_path / output)
    assert_declined(run, tmp_path, output)
    assert {p.name for p in tmp_path.iterdir()} == {"out", "folder.pfm"}


def test_full_disk(command, tmp_path):
    """A device is written to, never replaced by a file; one that takes nothing is an error."""
    full = tmp_path / "full"
    try:
        os.mknod(full, 0o666 | stat.S_IFCHR, os.makedev(1, 7))  # a /dev/full of our own
    except PermissionError:
        pytest.skip("making a device needs root")
    run, _ = attempt(tmp_path, GOOD, "--stats", full)
    assert stat.S_ISCHR(full.stat().st_mode), "the device was replaced"
    assert run.status in (1, 2) and "trilume: error:" in run.stderr and no_noise(run.stderr), run.stderr


def test_too_few_arguments(command, tmp_path):
    run = harness.run("render", GOOD)
    assert run.status == 2 and run.stderr.startswith("trilume: error:"), run.stderr


def test_unknown_command(command):
    run = harness.run("frobnicate")
    assert run.status == 2 and "frobnicate" in run.stderr, run.stderr


def test_help_and_info(command):
    for arguments in (("--help",), ("render", "--help"), ("info",), ("info", "--json")):
        assert harness.run(*arguments).status == 0, arguments
