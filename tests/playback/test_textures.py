"""Textures as UsdUVTexture has them."""

import numpy as np
import OpenImageIO as oiio
import pytest

import harness
from harness import CAMERA, LAMP, SQUARE_POINTS, matte, mesh, write_stage

# A square of four by four repetitions, lit from the front; the texture is white.
TILES = mesh(SQUARE_POINTS, extra="""texCoord2f[] primvars:st = [(-1, -1), (3, -1), (3, 3), (-1, 3)] (
            interpolation = "vertex"
        )""")


def textured(wraps):
    return matte().replace("color3f inputs:diffuseColor = (0.8, 0.8, 0.8)",
                           "color3f inputs:diffuseColor.connect = </World/Matte/Texture.outputs:rgb>").rstrip()[:-1] + f"""
        def Shader "Texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./white.exr@
            {wraps}
            float2 inputs:st.connect = </World/Matte/Coordinates.outputs:result>
            float3 outputs:rgb
        }}
        def Shader "Coordinates"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }}
    }}
"""


def authored(mode):
    return f'token inputs:wrapS = "{mode}"\n            token inputs:wrapT = "{mode}"'


def write_white(path, wraps=None):
    """A picture of 64 x 64 white pixels; `wraps`: the modes in its metadata."""
    spec = oiio.ImageSpec(64, 64, 3, "half")
    if wraps:
        spec.attribute("wrapmodes", wraps)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec) and output.write_image(np.ones((64, 64, 3), np.float32))
    output.close()


@pytest.mark.parametrize("wraps, metadata, tiles", [
    ("", None, 1), (authored("useMetadata"), None, 1), (authored("black"), "periodic,periodic", 1),
    ("", "periodic,periodic", 16), (authored("repeat"), None, 16), (authored("clamp"), None, 16),
    ('token inputs:wrapS = "repeat"', None, 4), ("", "black,clamp", 4)],
    ids=["unauthored", "useMetadata", "black", "file repeats", "repeat", "clamp", "repeat s", "file clamps t"])
def test_wrap_modes(render, tmp_path, wraps, metadata, tiles):
    """Of sixteen tiles of the square so many are white, the others black."""
    write_white(tmp_path / "white.exr", metadata)
    stage = write_stage(tmp_path / "stage.usda", CAMERA, LAMP, textured(wraps), TILES)
    albedo = render(stage, "-t", "raytrace", "--spp", 16, aovs=("albedo",), size=(96, 54)).aovs["albedo"]
    square = 2 * 2 / (4 * 36 / 30 * 4 * 20.25 / 30)  # its share of the picture
    assert albedo.mean() == pytest.approx(square * tiles / 16, rel=0.05)


def test_filters_take_nothing_from_beyond_the_edge(render, tmp_path):
    """A white picture that ends where its square does: white at the edge, too, where a pixel is as wide as an eighth of it."""
    write_white(tmp_path / "white.exr")
    square = TILES.replace("(-1, -1), (3, -1), (3, 3), (-1, 3)", "(0, 0), (1, 0), (1, 1), (0, 1)")
    images = [render(write_stage(tmp_path / f"{name}.usda", CAMERA, LAMP, surface, square), "-t", "raytrace", "--spp", 64,
                     aovs=("albedo",), size=(16, 9)).aovs["albedo"]
              for name, surface in {"textured": textured(""), "white": matte(1.0)}.items()]
    assert images[1].max() > 0.9 and images[0] == pytest.approx(images[1], rel=1e-5)
