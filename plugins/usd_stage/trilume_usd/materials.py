"""Maps UsdPreviewSurface, standard_surface and OpenPBR onto the engine's layered model.

A record has the names of trilume::Material's fields; "maps" has textures by the name of the TextureInput.
"""

from pxr import UsdShade

from .diagnostics import reason
from .network import Network, Texture, multiply

DEFAULT = {"baseColor": (0.18, 0.18, 0.18), "ior": 1.0, "roughness": 1.0, "maps": {}}  # Lambert
_UNIT = ("metallic", "roughness", "specular", "transmission", "clearcoat", "clearcoatRoughness", "opacity",
         "opacityThreshold")
_COLORS = ("baseColor", "specularColor", "transmissionColor", "emission")
_MAPPED = {"baseColor": "baseColorMap", "metallic": "metallicMap", "roughness": "roughnessMap",
           "emission": "emissionMap", "opacity": "opacityMap", "normal": "normalMap",
           "specularColor": "specularColorMap", "clearcoat": "clearcoatMap",
           "clearcoatRoughness": "clearcoatRoughnessMap", "transmission": "transmissionMap"}


class MaterialReader:
    """A UsdShade material; primvars: values that the shaded mesh supplies, by name."""

    def __init__(self, prim, files, warn, moment, primvars=None):
        self.path = str(prim.GetPath())
        self._prim = prim
        self._files = files
        self._warn = warn
        self._primvars = primvars or {}
        _, network = self._evaluate(moment)
        self.varying = network.varying
        self.primvar_names = network.primvar_names - {""}
        self.uv_name = network.uv_names[0] if network.uv_names else "st"
        if len(set(network.uv_names)) > 1:
            warn(prim.GetPath(), f"several sets of texture coordinates: only {self.uv_name} is used")

    def read(self, moment):
        return self._evaluate(moment)[0]

    def _evaluate(self, moment):
        network = Network(moment.time, self._files, self._warn, self._primvars)
        shader, identifier, surface = surface_shader(self._prim)
        if surface:
            try:
                return finish(surface(shader, network, self._warn), self._prim, self._warn), network
            except Exception as error:  # a cycle, for example
                self._warn(self._prim.GetPath(), f"not readable ({reason(error)}): the default material is used")
        elif shader:
            what = f"surface shader {identifier or 'without id'} is not supported"
            self._warn(self._prim.GetPath(), f"{what}: the default material is used")
        elif UsdShade.Material(self._prim).GetDisplacementOutput().HasConnectedSource():
            self._warn(self._prim.GetPath(), "displacement is not supported: ignored")
        return DEFAULT, network


class ColorReader:
    """What a mesh without material looks like: its displayColor as a Lambert surface."""

    varying = False

    def __init__(self, path, color):
        self.path = path
        self._color = color

    def read(self, moment):
        return {**DEFAULT, "baseColor": self._color}


class GlowReader:
    """A mesh light's surface: the bound material with the light's radiance in place of its own emission."""

    def __init__(self, path, base, emission, sync_mode, area):
        """sync_mode: the schema's light:materialSyncMode. area(moment): of the mesh in the world, for `normalize`."""
        self.path = path
        self.varying = base.varying or emission.varying
        self._base = base
        self._emission = emission
        self._sync_mode = sync_mode
        self._area = area

    def read(self, moment):
        radiance = self._emission.radiance(moment)
        if self._emission.normalized(moment):
            area = self._area(moment)
            radiance = multiply(radiance, 1 / area if area > 0 else 0.0)
        record = DEFAULT if self._sync_mode == "noMaterialResponse" else self._base.read(moment)
        record = {**record, "maps": dict(record["maps"])}
        if self._sync_mode == "noMaterialResponse":
            record["baseColor"] = (0.0, 0.0, 0.0)
        glow = record["maps"].pop("emissionMap", None) or record.get("emission", (0.0, 0.0, 0.0))
        if self._sync_mode == "materialGlowTintsLight" and (isinstance(glow, Texture) or any(glow)):
            glow = multiply(glow, radiance)
            if isinstance(glow, Texture):
                record["maps"]["emissionMap"] = glow
                glow = radiance
            radiance = glow
        return {**record, "emission": radiance}


def surface_shader(prim):
    """(shader, its id, the function that reads it): the first of MaterialX's and the universal one that can be read.
    The function is None when none can, and so is the shader when the material has no surface."""
    material = UsdShade.Material(prim)
    shaders = [material.ComputeSurfaceSource(context)[0] for context in ("mtlx", "")]
    found = [(shader, str(shader.GetIdAttr().Get() or "")) for shader in shaders if shader]
    for shader, identifier in found:
        for prefix, surface in _SURFACES.items():
            if identifier.startswith(prefix):
                return shader, identifier, surface
    return (*found[0], None) if found else (None, "", None)


def finish(record, prim, warn):
    """Splits constants from textures, and puts numbers into their ranges."""
    result, maps = {}, {}
    for name, value in record.items():
        if isinstance(value, Texture):
            maps[_MAPPED[name]] = value
            value = value.constant
        if value is None or name == "normal":
            continue
        if name in _COLORS:
            color = value if isinstance(value, tuple) else (value,) * 3
            value = tuple(max(0.0, float(c)) for c in color[:3])
        elif name in _UNIT:
            value = value[0] if isinstance(value, tuple) else value
            value = min(1.0, max(0.0, float(value)))
        elif name in ("ior", "clearcoatIor") and not value >= 1:
            warn(prim.GetPath(), f"index of refraction {value:g} is below 1: 1.5 is used")
            value = 1.5
        result[name] = value
    return {**result, "maps": maps}


def preview_surface(shader, network, warn):
    value = network.value
    diffuse = value(shader, "diffuseColor", (0.18, 0.18, 0.18))
    workflow = bool(network.constant(shader, "useSpecularWorkflow", 0))
    record = {
        "baseColor": diffuse,
        "emission": value(shader, "emissiveColor", (0.0, 0.0, 0.0)),
        "specularWorkflow": workflow,
        "specularColor": value(shader, "specularColor", (0.0, 0.0, 0.0)) if workflow else (1.0, 1.0, 1.0),
        "metallic": 0.0 if workflow else value(shader, "metallic", 0.0),
        "roughness": value(shader, "roughness", 0.5),
        "ior": network.constant(shader, "ior", 1.5),
        "clearcoat": value(shader, "clearcoat", 0.0),
        "clearcoatRoughness": value(shader, "clearcoatRoughness", 0.01),
        "opacity": value(shader, "opacity", 1.0),
        "opacityThreshold": network.constant(shader, "opacityThreshold", 0.0),
        "normal": value(shader, "normal", (0.0, 0.0, 1.0)),
    }
    if shader.GetInput("displacement") and shader.GetInput("displacement").HasConnectedSource():
        warn(shader.GetPath(), "displacement is not supported: ignored")
    # A transparent dielectric refracts; everything else with an opacity is a cut-out.
    opacity = record["opacity"]
    refracts = (network.constant(shader, "opacityMode", "transparent") == "transparent" and record["metallic"] == 0
                and not isinstance(opacity, Texture) and opacity < 1 and not record["opacityThreshold"] > 0)
    if refracts:
        tint = diffuse
        if isinstance(diffuse, Texture):
            warn(shader.GetPath(), "a textured tint of glass is not supported: it is clear")
            tint = (1.0, 1.0, 1.0)
        record.update(opacity=1.0, transmission=1.0 - opacity, transmissionColor=tint)
    return record


def standard_surface(shader, network, warn):
    value = network.value
    name_ignored(shader, network, warn, ("subsurface", "sheen", "thin_film_thickness", "transmission_depth",
                                         "specular_anisotropy", "coat_anisotropy"))
    return {
        "baseColor": network.product(shader, ("base_color", (0.8, 0.8, 0.8)), ("base", 1.0)),
        "metallic": value(shader, "metalness", 0.0),
        "specular": network.constant(shader, "specular", 1.0),
        "specularColor": value(shader, "specular_color", (1.0, 1.0, 1.0)),
        "roughness": value(shader, "specular_roughness", 0.2),
        "ior": network.constant(shader, "specular_IOR", 1.5),
        "transmission": value(shader, "transmission", 0.0),
        "transmissionColor": network.constant(shader, "transmission_color", (1.0, 1.0, 1.0)),
        "clearcoat": value(shader, "coat", 0.0),
        "clearcoatRoughness": value(shader, "coat_roughness", 0.1),
        "clearcoatIor": network.constant(shader, "coat_IOR", 1.5),
        "emission": network.product(shader, ("emission_color", (1.0, 1.0, 1.0)), ("emission", 0.0)),
        "opacity": presence(value(shader, "opacity", (1.0, 1.0, 1.0))),
        "normal": value(shader, "normal", (0.0, 0.0, 1.0)),
    }


def open_pbr(shader, network, warn):
    value = network.value
    name_ignored(shader, network, warn, ("subsurface_weight", "fuzz_weight", "thin_film_weight", "transmission_depth",
                                         "specular_roughness_anisotropy", "coat_roughness_anisotropy"))
    return {
        "baseColor": network.product(shader, ("base_color", (0.8, 0.8, 0.8)), ("base_weight", 1.0)),
        "metallic": value(shader, "base_metalness", 0.0),
        "specular": network.constant(shader, "specular_weight", 1.0),
        "specularColor": value(shader, "specular_color", (1.0, 1.0, 1.0)),
        "roughness": value(shader, "specular_roughness", 0.3),
        "ior": network.constant(shader, "specular_ior", 1.5),
        "transmission": value(shader, "transmission_weight", 0.0),
        "transmissionColor": network.constant(shader, "transmission_color", (1.0, 1.0, 1.0)),
        "clearcoat": value(shader, "coat_weight", 0.0),
        "clearcoatRoughness": value(shader, "coat_roughness", 0.0),
        "clearcoatIor": network.constant(shader, "coat_ior", 1.6),
        "emission": network.product(shader, ("emission_color", (1.0, 1.0, 1.0)), ("emission_luminance", 0.0)),
        "opacity": value(shader, "geometry_opacity", 1.0),
        "normal": value(shader, "geometry_normal", (0.0, 0.0, 1.0)),
    }


def presence(opacity):
    """standard_surface's opacity is a colour; presence is its mean."""
    return sum(opacity) / len(opacity) if isinstance(opacity, tuple) else opacity


def name_ignored(shader, network, warn, names):
    for name in names:
        if network.constant(shader, name, 0.0):
            warn(shader.GetPath(), f"{name} is not supported: ignored")


_SURFACES = {"UsdPreviewSurface": preview_surface, "ND_UsdPreviewSurface": preview_surface,
             "ND_standard_surface": standard_surface, "ND_open_pbr_surface": open_pbr}
