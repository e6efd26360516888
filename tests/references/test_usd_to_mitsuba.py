"""The converter against closed forms. Runs where Mitsuba is installed (tools/requirements-references.txt)."""

import math

import numpy as np
import pytest

mi = pytest.importorskip("mitsuba")

from trilume_bench import metrics, offline  # noqa: E402

offline.choose_variant()
from trilume_bench import usd_to_mitsuba  # noqa: E402

HEAD = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n'
CAMERA = """
def Camera "Camera" {
    float horizontalAperture = 36
    float verticalAperture = 20.25
    float focalLength = 36
    float2 clippingRange = (0.01, 100)
    %s
}
"""


def picture(tmp_path, text, spp=64, camera=""):
    path = tmp_path / "stage.usda"
    path.write_text(HEAD + CAMERA % camera + text)
    return np.array(mi.render(usd_to_mitsuba.load(path, 96, 54), spp=spp))


def center_of_light(image):
    """(u, v) in [0, 1], v downward."""
    weight = metrics.luminance(image)
    v, u = np.indices(weight.shape)
    return ((u + 0.5) * weight).sum() / weight.sum() / 96, ((v + 0.5) * weight).sum() / weight.sum() / 54


def sphere_light(x, y, z):
    return f'def SphereLight "Bulb" {{ float inputs:radius = 0.1\n float inputs:intensity = 2\n' \
           f'double3 xformOp:translate = ({x}, {y}, {z})\n uniform token[] xformOpOrder = ["xformOp:translate"]\n}}\n'


@pytest.mark.parametrize("offset, expected", [
    ("", (0.5, 0.5)),
    ("float horizontalApertureOffset = 9", (0.25, 0.5)),
    ("float verticalApertureOffset = 5.0625", (0.5, 0.75)),
])
def test_aperture_offsets_move_the_window(tmp_path, offset, expected):
    u, v = center_of_light(picture(tmp_path, sphere_light(0, 0, -4), camera=offset))
    assert u == pytest.approx(expected[0], abs=0.005) and v == pytest.approx(expected[1], abs=0.005)


def test_right_and_up_are_right_and_up(tmp_path):
    u, v = center_of_light(picture(tmp_path, sphere_light(1, 0.5, -4)))
    assert u > 0.6 and v < 0.4


@pytest.mark.parametrize("turn, expected", [(0, 0.0), (180, 1.25)])
def test_rect_lights_shine_along_minus_z(tmp_path, turn, expected):
    light = f'def RectLight "Lamp" {{ float inputs:width = 20\n float inputs:height = 20\n float inputs:intensity = 1.25\n' \
            f'double3 xformOp:translate = (0, 0, -4)\n float xformOp:rotateY = {turn}\n' \
            f'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]\n}}\n'
    assert picture(tmp_path, light).mean() == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("kind, size, area", [
    ("SphereLight", "float inputs:radius = 0.5", 4 * math.pi * 0.25),
    ("DiskLight", "float inputs:radius = 0.5", math.pi * 0.25),
    ("RectLight", "float inputs:width = 0.5\n float inputs:height = 2", 1.0),
    ("CylinderLight", "float inputs:radius = 0.25\n float inputs:length = 2", 2 * math.pi * 0.25 * 2),
])
def test_normalize_divides_by_area(tmp_path, kind, size, area):
    light = f'def {kind} "Lamp" {{ {size}\n float inputs:intensity = 3\n bool inputs:normalize = 1\n' \
            f'double3 xformOp:translate = (0, 0, -4)\n float xformOp:rotateY = 180\n' \
            f'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]\n}}\n'
    assert picture(tmp_path, light, spp=4).max() == pytest.approx(3 / area, rel=1e-4)


@pytest.mark.parametrize("pixel, at", [((32, 64), (0, 180)), ((32, 32), (-90, 0)), ((32, 96), (90, 0))])
def test_dome_texture_faces_plus_z_with_plus_x_on_its_left(tmp_path, pixel, at):
    """A bright texel at the image's centre lies toward +Z, one at a quarter of the width toward +X."""
    texture = np.full((64, 128, 3), 1e-3, dtype=np.float32)
    texture[pixel[0] - 2:pixel[0] + 2, pixel[1] - 2:pixel[1] + 2] = 50
    metrics.write_image(tmp_path / "dome.exr", texture)
    yaw = at[1] if at[1] else at[0]
    turn = f'float xformOp:rotateY = {yaw}\n uniform token[] xformOpOrder = ["xformOp:rotateY"]'
    image = picture(tmp_path, 'def DomeLight "Dome" { asset inputs:texture:file = @dome.exr@\n}\n', camera=turn)
    u, v = center_of_light(image)
    assert u == pytest.approx(0.5, abs=0.02) and v == pytest.approx(0.5, abs=0.03)


def test_closed_furnace(tmp_path):
    """Inside a sphere that emits 1 and reflects 0.8, radiance is 1 / (1 - 0.8). Emission is on the outside of a sphere:
    the furnace is a cube turned inside out."""
    corners = [(x, y, z) for z in (-2, 2) for y in (-2, 2) for x in (-2, 2)]
    faces = [0, 4, 5, 1, 2, 3, 7, 6, 0, 1, 3, 2, 0, 2, 6, 4, 1, 5, 7, 3, 4, 6, 7, 5]
    cube = f'''def Mesh "Cube" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
        point3f[] points = {corners}
        int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = {faces}
        uniform token subdivisionScheme = "none"
        rel material:binding = </M>
        }}
        def Material "M" {{
        token outputs:surface.connect = </M/S.outputs:surface>
        def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.8, 0.8, 0.8)
        color3f inputs:emissiveColor = (1, 1, 1)
        float inputs:ior = 1
        token outputs:surface
        }}
        }}'''
    assert picture(tmp_path, cube, spp=64).mean() == pytest.approx(5, rel=2e-3)
