"""Stages that suites need: content stages made extreme, and small ones from nothing. Each function writes `path`."""

from math import cos, pi, sin

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

BOX = 3.2  # metres: the size of the content's boxes


def edited(source, path, *edits):
    """A copy of the stage at `source` with `edits`, each a function of the opened stage."""
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(source)))
    for edit in edits:
        edit(stage)
    stage.GetRootLayer().Export(str(path))


# ---- edits -------------------------------------------------------------------------------------

def unit(factor):
    return lambda stage: UsdGeom.SetStageMetersPerUnit(stage, factor)


def scaled(factor):
    def edit(stage):
        UsdGeom.Xformable(stage.GetDefaultPrim()).AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(factor))
        for prim in stage.Traverse():
            if prim.IsA(UsdGeom.Camera):
                UsdGeom.Camera(prim).GetClippingRangeAttr().Set(Gf.Vec2f(0.01 * factor, 1000 * factor))
    return edit


def moved(offset):
    def edit(stage):
        UsdGeom.Xformable(stage.GetDefaultPrim()).AddTranslateOp().Set(Gf.Vec3d(*offset))
    return edit


def lights(stage):
    return [UsdLux.LightAPI(prim) for prim in stage.Traverse() if prim.HasAPI(UsdLux.LightAPI)]


def emission(factor, under="/World"):
    def edit(stage):
        for light in lights(stage):
            if str(light.GetPath()).startswith(under):
                light.GetIntensityAttr().Set(light.GetIntensityAttr().Get() * factor)
    return edit


def without_lights(stage):
    for light in lights(stage):
        stage.RemovePrim(light.GetPath())


def slivers(aspect):
    """Each quad becomes two, one of them a strip 1 / aspect as wide as it is long."""
    def edit(stage):
        for mesh in (UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)):
            points, indices = list(mesh.GetPointsAttr().Get()), list(mesh.GetFaceVertexIndicesAttr().Get())
            if set(mesh.GetFaceVertexCountsAttr().Get()) != {4}:
                continue
            faces = []
            for k in range(0, len(indices), 4):
                a, b, c, d = indices[k:k + 4]
                shares = [(a, b), (d, c)]
                cut = []
                for start, end in shares:
                    cut.append(len(points))
                    points.append(points[start] + (points[end] - points[start]) / aspect)
                faces += [(a, cut[0], cut[1], d), (cut[0], b, c, cut[1])]
            mesh.GetPointsAttr().Set(Vt.Vec3fArray(points))
            mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray([4] * len(faces)))
            mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray([i for face in faces for i in face]))
            for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
                subset.GetIndicesAttr().Set(Vt.IntArray([2 * i + j for i in subset.GetIndicesAttr().Get() for j in (0, 1)]))
    return edit


def needles(count, width):
    """Triangles as long as the box and `width` wide, spread through it; all together they cover next to nothing."""
    def edit(stage):
        points = []
        for k in range(count):
            x, y = BOX * ((k * 0.618034) % 1 - 0.5), 0.2 + 1.4 * ((k * 0.414214) % 1)
            points += [(x, y, -1.0), (x + width, y, -1.0), (x, y + 0.1, 1.0)]
        mesh(stage, "/World/Needles", points, [3] * count, matte(stage, "Needle", 0.5))
    return edit


def doubled(stage):
    """Every mesh stands twice in the same place."""
    for prim in [p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]:
        Sdf.CopySpec(stage.GetRootLayer(), prim.GetPath(), stage.GetRootLayer(),
                     prim.GetPath().ReplaceName(prim.GetName() + "Again"))


def bulb(path, center, radius, radiance):
    def edit(stage):
        light = UsdLux.SphereLight.Define(stage, path)
        light.CreateRadiusAttr(radius)
        light.CreateIntensityAttr(radiance)
        UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(*center))
    return edit


def sphere(path, center, radius):
    def edit(stage):
        ball = UsdGeom.Sphere.Define(stage, path)
        ball.CreateRadiusAttr(radius)
        ball.AddTranslateOp().Set(Gf.Vec3d(*center))
    return edit


def block(path, center, size, turn):
    """A box of `size` on the floor, turned by `turn` degrees; without the side that it stands on."""
    def edit(stage):
        x, z = (s / 2 for s in (size[0], size[2]))
        corners = [(a * x, y, b * z) for y in (0.0, size[1]) for b in (-1, 1) for a in (-1, 1)]
        sides = [4, 6, 7, 5, 0, 4, 5, 1, 1, 5, 7, 3, 3, 7, 6, 2, 2, 6, 4, 0]
        result = UsdGeom.Xformable(mesh(stage, path, corners, [4] * 5, matte(stage, "Block", 0.7), sides))
        result.AddTranslateOp().Set(Gf.Vec3d(*center))
        result.AddRotateYOp().Set(turn)
    return edit


def fine_ball(path, center, radius, triangles):
    def edit(stage):
        ball = UsdGeom.Xformable(_ball(stage, path, round((triangles / 4) ** 0.5), matte(stage, "Ball", 0.7)))
        ball.AddTranslateOp().Set(Gf.Vec3d(*center))
        ball.AddScaleOp().Set(Gf.Vec3f(radius))
    return edit


def metal_ball(roughness):
    def edit(stage):
        ball = UsdGeom.Sphere.Define(stage, "/World/Ball")
        ball.CreateRadiusAttr(0.4)
        UsdGeom.Xformable(ball).AddTranslateOp().Set(Gf.Vec3d(0, 0.9, 0.3))
        bind(ball, preview_surface(stage, "Metal", diffuseColor=0.9, metallic=1.0, roughness=roughness))
    return edit


# ---- parts -------------------------------------------------------------------------------------

def preview_surface(stage, name, **inputs):
    """A number stands for a grey where a colour is meant."""
    path = Sdf.Path("/World/Extra").AppendChild(name)
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    for key, value in inputs.items():
        if isinstance(value, str):
            shader.CreateInput(key, Sdf.ValueTypeNames.Token).Set(value)
        elif key.endswith("Color"):
            shader.CreateInput(key, Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(value))
        else:
            shader.CreateInput(key, Sdf.ValueTypeNames.Float).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material


def matte(stage, name, albedo):
    return preview_surface(stage, name, diffuseColor=albedo, metallic=0.0, ior=1.0)


def bind(prim, material):
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)


def mesh(stage, path, points, counts, material, indices=None):
    result = UsdGeom.Mesh.Define(stage, path)
    result.CreatePointsAttr(Vt.Vec3fArray([Gf.Vec3f(*p) for p in points]))
    result.CreateFaceVertexCountsAttr(Vt.IntArray(counts))
    result.CreateFaceVertexIndicesAttr(Vt.IntArray(indices or range(len(points))))
    result.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    result.CreateDoubleSidedAttr(True)
    bind(result, material)
    return result


def blank():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    return stage


def camera(stage, position, focal=30.0):
    result = UsdGeom.Camera.Define(stage, "/World/Camera")
    result.CreateHorizontalApertureAttr(36.0)
    result.CreateVerticalApertureAttr(20.25)
    result.CreateFocalLengthAttr(focal)
    result.CreateClippingRangeAttr(Gf.Vec2f(0.01, 1000))
    UsdGeom.Xformable(result).AddTranslateOp().Set(Gf.Vec3d(*position))


def furnace(path, ior):
    """A white ball and a glass ball under a white sky: radiance 1 wherever one looks, or energy leaks."""
    stage = blank()
    camera(stage, (0, 0, 4))
    dome = UsdLux.DomeLight.Define(stage, "/World/Sky")
    dome.CreateIntensityAttr(1.0)
    glass = preview_surface(stage, "Glass", diffuseColor=1.0, metallic=0.0, roughness=0.0, ior=ior, opacity=0.0,
                            opacityMode="transparent")
    for name, x, material in (("White", -0.8, matte(stage, "White", 1.0)), ("Glass", 0.8, glass)):
        ball = UsdGeom.Sphere.Define(stage, f"/World/{name}")
        ball.CreateRadiusAttr(0.7)
        UsdGeom.Xformable(ball).AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
        bind(ball, material)
    stage.GetRootLayer().Export(str(path))


def soak(source, path, period):
    """The stage at `source`, its lamp moving, a bulb that goes on and off, and a glass ball that comes and goes."""
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(source)))
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(1 + period)
    lamp = UsdGeom.Xformable(stage.GetPrimAtPath("/World/Lamp"))
    place = lamp.GetOrderedXformOps()[0]
    home = place.Get()
    bulb("/World/Bulb", (-0.9, 1.2, 0.4), 0.1, 20.0)(stage)
    light = UsdLux.LightAPI(stage.GetPrimAtPath("/World/Bulb"))
    ball = UsdGeom.Imageable(stage.GetPrimAtPath("/World/GlassSphere"))
    for share, side in ((0, 0), (0.25, 0.5), (0.5, 0), (0.75, -0.5), (1, 0)):
        place.Set(home + Gf.Vec3d(side, 0, 0), 1 + share * period)
    # Held: time samples of intensity are interpolated, so each step has two.
    for share, intensity in ((0, 20.0), (0.4, 20.0), (0.4 + 1 / period, 0.0), (1 - 1 / period, 0.0)):
        light.GetIntensityAttr().Set(intensity, 1 + share * period)
    for share, shown in ((0, "inherited"), (0.6, "invisible"), (0.8, "inherited")):
        ball.GetVisibilityAttr().Set(shown, 1 + share * period)
    stage.GetRootLayer().Export(str(path))


# ---- growing stages ----------------------------------------------------------------------------

def hall(path, lamps=1, instances=1, triangles=12):
    """A room of constant size and power with `lamps` bulbs below its ceiling, `instances` of a ball of about `triangles`."""
    stage = blank()
    camera(stage, (0, 2, 9), 24.0)
    white = matte(stage, "White", 0.7)
    corners = [(x, y, z) for z in (-5.0, 10.0) for y in (0.0, 4.0) for x in (-6.0, 6.0)]
    mesh(stage, "/World/Room", corners, [4] * 6, white,
         [0, 4, 5, 1, 2, 3, 7, 6, 0, 1, 3, 2, 0, 2, 6, 4, 1, 5, 7, 3, 4, 6, 7, 5])
    _bulbs(stage.GetRootLayer(), [(x, 3.7, z) for x, z in _grid(lamps, 10.0, 8.0)], 0.02, 6000.0 / lamps)
    ball = _ball(stage, "/World/Balls/Ball", max(2, round((triangles / 4) ** 0.5)), white)
    spread = UsdGeom.PointInstancer.Define(stage, "/World/Balls")
    spread.CreatePrototypesRel().SetTargets([ball.GetPath()])
    size = 0.35 * (80.0 / instances) ** 0.5
    places = _grid(instances, 10.0, 8.0)
    spread.CreateProtoIndicesAttr(Vt.IntArray([0] * instances))
    spread.CreatePositionsAttr(Vt.Vec3fArray([Gf.Vec3f(x, min(size, 1.0), z) for x, z in places]))
    spread.CreateScalesAttr(Vt.Vec3fArray([Gf.Vec3f(min(size, 1.0))] * instances))
    stage.GetRootLayer().Export(str(path))


def _bulbs(layer, places, radius, radiance):
    """Sphere lights, past the stage, which would compose anew for each of them."""
    with Sdf.ChangeBlock():
        for number, place in enumerate(places):
            prim = Sdf.CreatePrimInLayer(layer, f"/World/Bulbs/Bulb{number}")
            prim.specifier, prim.typeName = Sdf.SpecifierDef, "SphereLight"
            prim.nameParent.specifier = Sdf.SpecifierDef
            for name, kind, value in (("inputs:radius", Sdf.ValueTypeNames.Float, radius),
                                      ("inputs:intensity", Sdf.ValueTypeNames.Float, radiance),
                                      ("xformOp:translate", Sdf.ValueTypeNames.Double3, Gf.Vec3d(*place)),
                                      ("xformOpOrder", Sdf.ValueTypeNames.TokenArray, Vt.TokenArray(["xformOp:translate"]))):
                Sdf.AttributeSpec(prim, name, kind).default = value


def _grid(count, width, depth):
    """`count` places of a grid about the origin: (x, z)."""
    across = max(1, round((count * width / depth) ** 0.5))
    down = -(-count // across)
    return [(width * ((k % across + 0.5) / across - 0.5), depth * ((k // across + 0.5) / down - 0.5)) for k in range(count)]


def _ball(stage, path, n, material):
    """A unit ball of 4 n^2 triangles, less those at the poles."""
    points = [(sin(pi * i / n) * cos(pi * j / n), cos(pi * i / n), sin(pi * i / n) * sin(pi * j / n))
              for i in range(n + 1) for j in range(2 * n)]
    faces = []
    for i in range(n):
        for j in range(2 * n):
            a, b = i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n)
            faces += [(a, b, a + 2 * n)] if i > 0 else []
            faces += [(b, b + 2 * n, a + 2 * n)] if i < n - 1 else []
    return mesh(stage, path, points, [3] * len(faces), material, [v for face in faces for v in face])


# ---- motion ------------------------------------------------------------------------------------

def moving(prim, by, frames):
    """The prim at path `prim` moves evenly by the vector `by` over the frames 1 to `frames`."""
    def edit(stage):
        stage.SetStartTimeCode(1)
        stage.SetEndTimeCode(frames)
        place = UsdGeom.Xformable(stage.GetPrimAtPath(prim)).GetOrderedXformOps()[0]
        home = place.Get()
        place.Set(home, 1)
        place.Set(home + Gf.Vec3d(*by), frames)
    return edit


def brightened(prim, factor, frame, frames):
    """The light at path `prim` steps to `factor` times its intensity at `frame`."""
    def edit(stage):
        stage.SetStartTimeCode(1)
        stage.SetEndTimeCode(frames)
        intensity = UsdLux.LightAPI(stage.GetPrimAtPath(prim)).GetIntensityAttr()
        before = intensity.Get()
        intensity.Set(before, frame - 1)
        intensity.Set(before * factor, frame)
    return edit
