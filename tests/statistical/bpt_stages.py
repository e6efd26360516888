"""Small stages in which every kind of path counts: for estimators that must agree with each other."""

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from trilume_bench import metrics


def make_stage(path, camera=(0, 1, 4.5), look_down=8, lens=False):
    """An empty stage with a camera; `lens`: out of focus beyond 4 metres."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    view = UsdGeom.Camera.Define(stage, "/World/Camera")
    view.CreateHorizontalApertureAttr(36)
    view.CreateVerticalApertureAttr(20.25)
    view.CreateFocalLengthAttr(30)
    view.CreateClippingRangeAttr(Gf.Vec2f(0.01, 1000))
    if lens:
        view.CreateFStopAttr(0.5)
        view.CreateFocusDistanceAttr(4)
    view.AddTranslateOp().Set(Gf.Vec3d(*camera))
    view.AddRotateXOp().Set(-look_down)
    return stage


def material(stage, name, **inputs):
    """UsdPreviewSurface; colours as triples, texture files as strings (emissiveColor, opacity)."""
    surface = UsdShade.Material.Define(stage, f"/World/Materials/{name}")
    shader = UsdShade.Shader.Define(stage, f"/World/Materials/{name}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    surface.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    for key, value in {"ior": 1.0, "roughness": 1.0, "metallic": 0.0, **inputs}.items():
        color = key.endswith("Color")
        kind = Sdf.ValueTypeNames.Color3f if color else Sdf.ValueTypeNames.Token if key == "opacityMode" \
            else Sdf.ValueTypeNames.Float
        entry = shader.CreateInput(key, kind)
        if not isinstance(value, str) or key == "opacityMode":
            entry.Set(Gf.Vec3f(*value) if color else value)
            continue
        reader = UsdShade.Shader.Define(stage, f"/World/Materials/{name}/{key}")
        reader.CreateIdAttr("UsdUVTexture")
        reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(value)
        reader.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("raw")
        coordinates = UsdShade.Shader.Define(stage, f"/World/Materials/{name}/st")
        coordinates.CreateIdAttr("UsdPrimvarReader_float2")
        coordinates.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        reader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(coordinates.ConnectableAPI(), "result")
        entry.ConnectToSource(reader.ConnectableAPI(), "rgb" if color else "r")
    return surface


def bind(prim, surface):
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(surface)


def mesh(stage, name, points, faces, surface, normals=None, st=None):
    shape = UsdGeom.Mesh.Define(stage, f"/World/{name}")
    shape.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    shape.CreateFaceVertexCountsAttr([len(f) for f in faces])
    shape.CreateFaceVertexIndicesAttr([i for f in faces for i in f])
    shape.CreateSubdivisionSchemeAttr("none")
    if normals is not None:
        shape.CreateNormalsAttr([Gf.Vec3f(*map(float, n)) for n in normals])
        shape.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    if st is not None:
        UsdGeom.PrimvarsAPI(shape).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex).Set(
            [Gf.Vec2f(*map(float, t)) for t in st])
    bind(shape.GetPrim(), surface)
    return shape


def quad(stage, name, corner, u, v, surface):
    corner, u, v = map(np.asarray, (corner, u, v))
    return mesh(stage, name, [corner, corner + u, corner + u + v, corner + v], [[0, 1, 2, 3]], surface,
                st=[(0, 0), (1, 0), (1, 1), (0, 1)])


def sphere(stage, name, center, radius, surface):
    shape = UsdGeom.Sphere.Define(stage, f"/World/{name}")
    shape.CreateRadiusAttr(radius)
    shape.AddTranslateOp().Set(Gf.Vec3d(*center))
    bind(shape.GetPrim(), surface)
    return shape


def faceted_sphere(stage, name, center, radius, surface, segments=10):
    """Of few faces, with the normals of the true sphere: they differ much from those of the faces."""
    rows = segments // 2
    directions = [(np.sin(np.pi * i / rows) * np.cos(2 * np.pi * j / segments), np.cos(np.pi * i / rows),
                   np.sin(np.pi * i / rows) * np.sin(2 * np.pi * j / segments))
                  for i in range(rows + 1) for j in range(segments)]
    faces = []
    for i in range(rows):
        for j in range(segments):
            a, b = i * segments + j, i * segments + (j + 1) % segments
            c, d = a + segments, b + segments
            faces += ([[a, b, d]] if i > 0 else []) + ([[a, d, c]] if i < rows - 1 else [])
    return mesh(stage, name, np.asarray(center) + radius * np.asarray(directions), faces, surface, normals=directions)


def room(stage, albedo=(0.7, 0.7, 0.7)):
    """Floor, back wall and one side wall."""
    wall = material(stage, "Wall", diffuseColor=albedo)
    red = material(stage, "Red", diffuseColor=(0.7, 0.2, 0.1))
    quad(stage, "Floor", (-3, 0, -2), (0, 0, 6), (6, 0, 0), wall)
    quad(stage, "Back", (-3, 0, -2), (6, 0, 0), (0, 4, 0), wall)
    quad(stage, "Side", (-3, 0, -2), (0, 4, 0), (0, 0, 6), red)


def light(stage, kind, name, intensity, at=(0, 0, 0), turn=(0, 0, 0), **inputs):
    lamp = getattr(UsdLux, kind).Define(stage, f"/World/{name}")
    lamp.CreateIntensityAttr(intensity)
    for key, value in inputs.items():
        getattr(lamp, f"Create{key[0].upper()}{key[1:]}Attr")(value)
    lamp.AddTranslateOp().Set(Gf.Vec3d(*at))
    lamp.AddRotateXYZOp().Set(Gf.Vec3f(*turn))
    return lamp


def spots(path, width=16, height=8, low=0.1):
    """A picture with bright squares on a dark ground, asymmetric."""
    pixels = np.full((height, width, 3), low, dtype=np.float32)
    pixels[1:3, 2:5] = (2.0, 1.6, 1.0)
    pixels[5:6, 10:13] = (0.5, 1.0, 2.0)
    metrics.write_image(path, pixels)
    return str(path)


def objects(path, lens=True):
    """Mirrors, glass, plastic, rough metal and rough glass under lamps of every finite kind."""
    stage = make_stage(path, lens=lens)
    room(stage)
    glass = material(stage, "Glass", diffuseColor=(1, 1, 1), ior=1.5, opacity=0.0, roughness=0.0)
    frosted = material(stage, "Frosted", diffuseColor=(0.9, 1, 0.9), ior=1.4, opacity=0.0, roughness=0.3)
    steel = material(stage, "Steel", diffuseColor=(0.8, 0.7, 0.6), metallic=1.0, roughness=0.25)
    mirror = material(stage, "Mirror", diffuseColor=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    plastic = material(stage, "Plastic", diffuseColor=(0.2, 0.4, 0.7), ior=1.5, roughness=0.0)
    coated = material(stage, "Coated", diffuseColor=(0.7, 0.3, 0.2), ior=1.5, roughness=0.4, clearcoat=1.0,
                      clearcoatRoughness=0.0)
    faceted_sphere(stage, "GlassBall", (-1.5, 0.5, 0.6), 0.5, glass)
    sphere(stage, "FrostedBall", (-0.4, 0.45, 0.9), 0.45, frosted)
    sphere(stage, "SteelBall", (0.7, 0.5, 0.3), 0.5, steel)
    faceted_sphere(stage, "MirrorBall", (1.8, 0.6, 0.4), 0.6, mirror)
    sphere(stage, "PlasticBall", (0.2, 0.3, 1.6), 0.3, plastic)
    sphere(stage, "CoatedBall", (1.3, 0.25, 1.5), 0.25, coated)
    light(stage, "SphereLight", "Bulb", 120, (-1.5, 2.2, 1.0), radius=0.12)
    light(stage, "DiskLight", "Disk", 40, (1.8, 2.8, 0.5), (-90, 0, 0), radius=0.25)
    light(stage, "CylinderLight", "Tube", 30, (0.2, 2.5, -0.5), (0, 30, 0), radius=0.05, length=1.2)
    light(stage, "RectLight", "Panel", 8, (2.5, 1.5, 1.5), (0, 70, 0), width=0.6, height=0.9)
    stage.Save()
    return path


def sky(path, picture):
    """Lights at infinity over glass, a cut-out and a glowing picture. `picture`: where to write the texture."""
    texture = spots(picture)
    stage = make_stage(path)
    wall = material(stage, "Wall", diffuseColor=(0.7, 0.7, 0.7))
    quad(stage, "Floor", (-3, 0, -2), (0, 0, 6), (6, 0, 0), wall)
    glass = material(stage, "Glass", diffuseColor=(1, 1, 1), ior=1.5, opacity=0.0, roughness=0.0)
    sphere(stage, "Ball", (-1, 0.6, 0.5), 0.6, glass)
    veil = material(stage, "Veil", diffuseColor=(0.5, 0.5, 0.2), opacity=0.5, opacityMode="presence")
    quad(stage, "Veil", (0, 0.3, 0.5), (1.2, 0, 0.3), (0, 1.0, 0), veil)
    glow = material(stage, "Glow", diffuseColor=(0.2, 0.2, 0.2), emissiveColor=texture)
    quad(stage, "Sign", (1.0, 0.2, -0.8), (1.4, 0, 0.2), (0, 1.0, 0), glow)
    dome = light(stage, "DomeLight", "Sky", 0.7, turn=(0, 40, 0))
    dome.CreateTextureFileAttr(texture)
    light(stage, "DistantLight", "Sun", 1.5, turn=(-50, 30, 0), angle=4, normalize=True)
    light(stage, "DistantLight", "Moon", 30, turn=(-60, -50, 0), angle=8)
    stage.Save()
    return path


def inside_glass(path):
    """The camera stands inside a glass ball, the lamp and the room outside."""
    stage = make_stage(path, camera=(0, 1.2, 2.5), look_down=5)
    room(stage)
    glass = material(stage, "Glass", diffuseColor=(1, 1, 1), ior=1.5, opacity=0.0, roughness=0.0)
    sphere(stage, "Around", (0, 1.2, 2.4), 0.8, glass)
    matte = material(stage, "Matte", diffuseColor=(0.3, 0.6, 0.3))
    sphere(stage, "Within", (0.1, 0.95, 2.0), 0.15, matte)
    light(stage, "SphereLight", "Bulb", 10, (0.8, 2.6, 0.5), radius=0.4)
    light(stage, "SphereLight", "Spark", 4, (-0.3, 1.4, 2.2), radius=0.1)
    stage.Save()
    return path


def sun_on_glass(path, angle):
    """A glass ball on a floor in a sun of that many degrees."""
    stage = make_stage(path)
    quad(stage, "Floor", (-3, 0, -2), (0, 0, 6), (6, 0, 0), material(stage, "Wall", diffuseColor=(0.7, 0.7, 0.7)))
    sphere(stage, "Ball", (0, 0.6, 0.5), 0.6, material(stage, "Glass", diffuseColor=(1, 1, 1), ior=1.5, opacity=0.0,
                                                       roughness=0.0))
    light(stage, "DistantLight", "Sun", 1.5, turn=(-50, 30, 0), angle=angle, normalize=True)
    stage.Save()
    return path
