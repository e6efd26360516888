"""Evaluates shader networks: an input is a constant, or a texture with what is done to its texels and coordinates."""

import math
from typing import NamedTuple, Optional

from pxr import UsdShade

from .files import find_file

_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}
_WRAPS = {"periodic": "repeat", "repeat": "repeat", "clamp": "clamp", "mirror": "mirror", "black": "black",
          "constant": "black", "useMetadata": "file"}
_SPACES = {"sRGB": "srgb", "srgb_texture": "srgb", "srgb": "srgb", "raw": "linear", "lin_rec709": "linear",
           "linear": "linear", "none": "linear"}
IDENTITY = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)  # columns: du, dv, offset


class Texture(NamedTuple):
    """texel(channel) * scale + bias at coordinates * st; `constant` stands in when the file cannot be read.

    Wraps: repeat, clamp, mirror, black, or `file` for what its metadata says."""

    file: Optional[str]
    space: str = "auto"
    wrap_s: str = "repeat"
    wrap_t: str = "repeat"
    channel: int = -1
    scale: tuple = (1.0, 1.0, 1.0, 1.0)
    bias: tuple = (0.0, 0.0, 0.0, 0.0)
    coordinates: tuple = IDENTITY
    constant: object = None

    def times(self, factor):
        factor = as_color(factor) + (1.0,)
        constant = self.constant
        if constant is not None:
            constant = multiply(constant, factor[:3] if isinstance(constant, tuple) else factor[0])
        return self._replace(scale=tuple(s * f for s, f in zip(self.scale, factor)),
                             bias=tuple(b * f for b, f in zip(self.bias, factor)), constant=constant)


def as_color(value):
    return tuple(float(v) for v in value[:3]) if hasattr(value, "__len__") else (float(value),) * 3


def multiply(value, factor):
    """Of constants, or of a texture and a constant."""
    if isinstance(factor, Texture):
        value, factor = factor, value
    if isinstance(value, Texture):
        return value.times(factor)
    if isinstance(value, tuple) or isinstance(factor, tuple):
        return tuple(a * b for a, b in zip(as_color(value), as_color(factor)))
    return value * factor


class Network:
    """Evaluates at one time; remembers whether anything that it read may vary, and which primvars it needs."""

    def __init__(self, time, files, warn, primvars):
        """primvars: values by name, constant over the mesh that is shaded."""
        self.varying = False
        self.uv_names = []
        self.primvar_names = set()
        self._time = time
        self._files = files
        self._warn = warn
        self._primvars = primvars

    def constant(self, shader, name, default):
        """The input as written; textures are replaced by their constant."""
        value = self.value(shader, name, default)
        if not isinstance(value, Texture):
            return value
        constant = plain(value.constant, default)
        return default if constant is None else constant

    def value(self, shader, name, default):
        """A Texture, or else what `default` is: a string, a float, or a tuple of as many. `default`, with a warning,
        where the stage has something else."""
        source = shader.GetInput(name)
        attributes = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
        if not attributes:
            return default
        attribute = attributes[0]
        if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            value = self._output(UsdShade.Shader(attribute.GetPrim()), attribute, default)
        else:
            value = self._get(attribute)
        if value is None or isinstance(value, Texture):
            return default if value is None else value
        usable = plain(value, default)
        if usable is None:
            self._warn(shader.GetPath(), f"{name} is of another type or not finite: its default is used")
        return default if usable is None else usable

    def product(self, shader, first, second):
        """Of two inputs, as (name, default). Of two textures the first is used, with a warning."""
        value, factor = self.value(shader, *first), self.value(shader, *second)
        if isinstance(value, Texture) and isinstance(factor, Texture):
            self._warn(shader.GetPath(), f"the product of two textures is not supported: {second[0]} is ignored")
            return value
        return multiply(value, factor)

    def _get(self, attribute):
        self.varying |= attribute.ValueMightBeTimeVarying()
        return attribute.Get(self._time)

    def _output(self, shader, attribute, default):
        identifier = str(shader.GetIdAttr().Get() or "")
        output = attribute.GetName().removeprefix("outputs:")
        if identifier == "UsdUVTexture":
            return self._uv_texture(shader, output, default)
        if identifier.startswith(("ND_image_", "ND_tiledimage_")):
            return self._image(shader, identifier, default)
        if identifier.startswith("ND_normalmap"):
            return self._normal_map(shader, default)
        if identifier.startswith(("UsdPrimvarReader_", "ND_geompropvalue_")):
            return self._primvar(shader, default)
        if identifier.startswith("ND_constant_"):
            return self.value(shader, "value", default)
        self._warn(shader.GetPath(), f"shader {identifier or 'without id'} is not supported: its default is used")
        return default

    def _uv_texture(self, shader, output, default):
        fallback = shader.GetInput("fallback")
        constant = default
        if fallback and fallback.GetAttr().HasAuthoredValue():
            texel = self.constant(shader, "fallback", (0.0, 0.0, 0.0, 1.0))
            constant = texel[_CHANNELS[output]] if output in _CHANNELS else texel[:3]
        path = self._file(shader)
        if path is None:
            return constant
        return Texture(path, _SPACES.get(str(self.constant(shader, "sourceColorSpace", "auto")), "auto"),
                       _WRAPS.get(str(self.constant(shader, "wrapS", "useMetadata")), "file"),
                       _WRAPS.get(str(self.constant(shader, "wrapT", "useMetadata")), "file"),
                       _CHANNELS.get(output, -1), self.constant(shader, "scale", (1.0,) * 4),
                       self.constant(shader, "bias", (0.0,) * 4), self._coordinates(shader, "st"), constant)

    def _image(self, shader, identifier, default):
        constant = self.constant(shader, "default", default) if shader.GetInput("default") else default
        path = self._file(shader)
        if path is None:
            return constant
        attribute = UsdShade.Utils.GetValueProducingAttributes(shader.GetInput("file"))[0]
        scalar = identifier.endswith("_float")
        space = _SPACES.get(attribute.GetColorSpace(), "linear" if scalar or "vector" in identifier else "auto")
        du, dv = self.constant(shader, "uvtiling", (1.0, 1.0))
        offset = self.constant(shader, "uvoffset", (0.0, 0.0))
        tiles = compose((du, 0.0, 0.0, dv, -offset[0], -offset[1]), self._coordinates(shader, "texcoord"))
        return Texture(path, space, _WRAPS.get(str(self.constant(shader, "uaddressmode", "periodic")), "repeat"),
                       _WRAPS.get(str(self.constant(shader, "vaddressmode", "periodic")), "repeat"),
                       0 if scalar else -1, coordinates=tiles, constant=constant)

    def _normal_map(self, shader, default):
        source = self.value(shader, "in", default)
        if not isinstance(source, Texture):
            return default
        return source._replace(scale=(2.0, 2.0, 2.0, 1.0), bias=(-1.0, -1.0, -1.0, 0.0), constant=default)

    def _file(self, shader):
        source = shader.GetInput("file")
        attributes = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
        asset = self._get(attributes[0]) if attributes else None
        if not asset or not hasattr(asset, "resolvedPath") or not asset.path:
            self._warn(shader.GetPath(), "the texture names no file: a constant is used")
            return None
        return find_file(asset, attributes[0], self._files, self._warn)

    def _coordinates(self, shader, name):
        """The affine map that is applied to the mesh's st, noting which primvar that is."""
        source = shader.GetInput(name)
        attributes = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
        if not attributes or UsdShade.Utils.GetType(attributes[0].GetName()) != UsdShade.AttributeType.Output:
            return IDENTITY
        node = UsdShade.Shader(attributes[0].GetPrim())
        identifier = str(node.GetIdAttr().Get() or "")
        if identifier == "UsdTransform2d":
            angle = math.radians(self.constant(node, "rotation", 0.0))
            scale = self.constant(node, "scale", (1.0, 1.0))
            offset = self.constant(node, "translation", (0.0, 0.0))
            c, s = math.cos(angle), math.sin(angle)
            own = (c * scale[0], s * scale[0], -s * scale[1], c * scale[1], *offset)
            return compose(own, self._coordinates(node, "in"))
        if identifier.startswith(("UsdPrimvarReader_float2", "ND_geompropvalue_vector2")):
            key = "varname" if identifier.startswith("Usd") else "geomprop"
            self.uv_names.append(str(self.constant(node, key, "st") or "st"))
        elif not identifier.startswith("ND_texcoord_"):
            self._warn(node.GetPath(), f"texture coordinates by {identifier} are not supported: st is used")
        return IDENTITY

    def _primvar(self, shader, default):
        key = "geomprop" if shader.GetInput("geomprop") else "varname"
        name = str(self.constant(shader, key, "") or "")
        self.primvar_names.add(name)
        if name in self._primvars:
            return self._primvars[name]
        return self.constant(shader, "fallback", default) if shader.GetInput("fallback") else default


def compose(outer, inner):
    """Affine maps as (du.x, du.y, dv.x, dv.y, offset.x, offset.y): inner first."""
    a, b, c, d, x, y = outer
    p, q, r, s, u, v = inner
    return (a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * u + c * v + x, b * u + d * v + y)


def plain(value, default):
    """`value`, USD's or plain, as what `default` is: a string, a float, or a tuple of as many. None when it is something
    else or not finite. A number makes a grey; a colour may have an alpha."""
    if isinstance(value, str) or isinstance(default, str):
        return value if isinstance(value, str) and isinstance(default, str) else None
    count = len(default) if isinstance(default, tuple) else 1
    try:
        values = tuple(float(v) for v in value) if hasattr(value, "__len__") else (float(value),)
    except (TypeError, ValueError):
        return None
    if count == 3:
        values = values * 3 if len(values) == 1 else values[:3]
    if len(values) != count or not all(map(math.isfinite, values)):
        return None
    return values if isinstance(default, tuple) else values[0]
