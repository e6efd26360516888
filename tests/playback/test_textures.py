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


@pytest.mark.parametrize("wraps, metadata, tiles", [
    ("", None, 1), (authored("useMetadata"), None, 1), (authored("black"), "periodic,periodic", 1),
    ("", "periodic,periodic", 16), (authored("repeat"), None, 16), (authored("clamp"), None, 16),
    ('token inputs:wrapS = "repeat"', None, 4), ("", "black,clamp", 4)],
    ids=["unauthored", "useMetadata", "black", "file repeats", "repeat", "clamp", "repeat s", "file clamps t"])
def test_wrap_modes(render, tmp_path, wraps, metadata, tiles):
    """Of sixteen tiles of the square so many are white, the others black."""
    spec = oiio.ImageSpec(64, 64, 3, "half")
    if metadata:
        spec.attribute("wrapmodes", metadata)
    output = oiio.ImageOutput.create(str(tmp_path / "white.exr"))
    assert output.open(str(tmp_path / "white.exr"), spec) and output.write_image(np.ones((64, 64, 3), np.float32))
    output.close()
    stage = write_stage(tmp_path / "stage.usda", CAMERA, LAMP, textured(wraps), TILES)
    albedo = render(stage, "-t", "raytrace", "--spp", 16, aovs=("albedo",), size=(96, 54)).aovs["albedo"]
    square = 2 * 2 / (4 * 36 / 30 * 4 * 20.25 / 30)  # its share of the picture
    assert albedo.mean() == pytest.approx(square * tiles / 16, rel=0.05)
