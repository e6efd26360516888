#!/usr/bin/env python3
"""Writes the USD stages beside it: the scenes of the paper's evaluation, and `animated`.

    .venv/bin/python3 content/generate.py            every stage
    .venv/bin/python3 content/generate.py maze       the named ones

The output is the same byte for byte on every run. Conventions of all stages: metres, Y up, 16:9 camera, polygons as they
stand (no subdivision, flat normals), and no two surfaces in one plane: lamps hang a centimetre below the ceiling, and
furniture reaches two centimetres through the floor.
"""

import math
import sys
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

HERE = Path(__file__).resolve().parent
SUNK = 0.02  # how far a thing that stands on the floor reaches through it, metres
GAP = 0.01   # between a lamp or mirror and the wall that carries it, metres

WARM = (1.0, 0.86, 0.68)
DAYLIGHT = (0.82, 0.92, 1.0)
WHITE, RED, GREEN = (0.75, 0.75, 0.73), (0.63, 0.065, 0.05), (0.14, 0.45, 0.09)


class Stage:
    """A stage under construction: one root, one camera, materials made on first use."""

    def __init__(self, name, description):
        self.name = name
        self.usd = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageUpAxis(self.usd, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(self.usd, 1.0)
        self.usd.SetDefaultPrim(UsdGeom.Xform.Define(self.usd, "/World").GetPrim())
        self.usd.GetRootLayer().documentation = description
        self.materials = {}

    def write(self):
        self.usd.GetRootLayer().Export(str(HERE / f"{self.name}.usda"))

    # ---- materials ----

    def _material(self, name, **inputs):
        if name not in self.materials:
            path = Sdf.Path("/World/Materials").AppendChild(name)
            UsdGeom.Scope.Define(self.usd, "/World/Materials")
            material = UsdShade.Material.Define(self.usd, path)
            shader = UsdShade.Shader.Define(self.usd, path.AppendChild("Surface"))
            shader.CreateIdAttr("UsdPreviewSurface")
            for key, value in inputs.items():
                kind = Sdf.ValueTypeNames.Float
                if isinstance(value, tuple):
                    kind, value = Sdf.ValueTypeNames.Color3f, Gf.Vec3f(*value)
                elif isinstance(value, str):
                    kind = Sdf.ValueTypeNames.Token
                shader.CreateInput(key, kind).Set(value)
            material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
            self.materials[name] = material
        return self.materials[name]

    def matte(self, name, color):
        """Lambert: an index of refraction of 1 leaves no specular lobe."""
        return self._material(name, diffuseColor=color, metallic=0.0, roughness=1.0, ior=1.0)

    def mirror(self, name="Mirror"):
        return self._material(name, diffuseColor=(1.0, 1.0, 1.0), metallic=1.0, roughness=0.0)

    def glass(self, name="Glass", ior=1.5):
        return self._material(name, diffuseColor=(1.0, 1.0, 1.0), metallic=0.0, roughness=0.0, ior=ior, opacity=0.0,
                              opacityMode="transparent")

    def bind(self, prim, material):
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)

    # ---- geometry ----

    def mesh(self, path, points, quads, materials):
        """Quads wound counter-clockwise seen from the front; `materials`: one, or one per quad (GeomSubsets)."""
        mesh = UsdGeom.Mesh.Define(self.usd, path)
        mesh.CreatePointsAttr(Vt.Vec3fArray([Gf.Vec3f(*p) for p in points]))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([len(q) for q in quads]))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray([i for q in quads for i in q]))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
        if not isinstance(materials, list):
            self.bind(mesh.GetPrim(), materials)
            return mesh
        faces = {}
        for face, material in enumerate(materials):
            faces.setdefault(material.GetPath().name, []).append(face)
        binding = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
        for name, indices in faces.items():
            subset = binding.CreateMaterialBindSubset(name, Vt.IntArray(indices))
            self.bind(subset.GetPrim(), self.materials[name])
        return mesh

    def room(self, path, low, high, left, right, rest, front=False):
        """The inside of a box, faces turned inward; open toward +Z unless `front`."""
        points = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
        quads = [(0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (0, 2, 6, 4), (1, 5, 7, 3)]  # floor ceiling back left right
        materials = [rest, rest, rest, left, right]
        if front:
            quads.append((4, 6, 7, 5))
            materials.append(rest)
        return self.mesh(path, points, quads, materials)

    def block(self, path, low, high, material, turn=0.0):
        """A box from `low` to `high`, turned by `turn` degrees about its own vertical axis."""
        center = [(a + b) / 2 for a, b in zip(low, high)]
        half = [(b - a) / 2 for a, b in zip(low, high)]
        points = [(x, y, z) for z in (-half[2], half[2]) for y in (-half[1], half[1]) for x in (-half[0], half[0])]
        quads = [(0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6), (0, 4, 6, 2), (1, 3, 7, 5)]
        mesh = self.mesh(path, [[round(c, 6) for c in p] for p in points], quads, material)
        place(mesh, center, (0, turn, 0))
        return mesh

    def standing(self, path, x, z, size, material, turn=0.0):
        """A block of `size` = (width, height, depth) that stands on the floor y = 0."""
        w, h, d = size
        return self.block(path, (x - w / 2, -SUNK, z - d / 2), (x + w / 2, h, z + d / 2), material, turn)

    def sphere(self, path, center, radius, material):
        sphere = UsdGeom.Sphere.Define(self.usd, path)
        sphere.CreateRadiusAttr(radius)
        sphere.CreateExtentAttr([Gf.Vec3f(-radius), Gf.Vec3f(radius)])
        place(sphere, center)
        self.bind(sphere.GetPrim(), material)
        return sphere

    # ---- lights and camera ----

    def _light(self, light, radiance, color):
        light.CreateIntensityAttr(radiance)
        light.CreateColorAttr(Gf.Vec3f(*color))
        return light

    def panel(self, path, center, width, height, radiance, color=WARM, rotate=(-90, 0, 0)):
        """A RectLight; unrotated it shines along -Z, by default straight down."""
        light = self._light(UsdLux.RectLight.Define(self.usd, path), radiance, color)
        light.CreateWidthAttr(width)
        light.CreateHeightAttr(height)
        place(light, center, rotate)
        return light

    def bulb(self, path, center, radius, radiance, color=WARM):
        light = self._light(UsdLux.SphereLight.Define(self.usd, path), radiance, color)
        light.CreateRadiusAttr(radius)
        place(light, center)
        return light

    def camera(self, position, pitch=0.0, yaw=0.0, horizontal_fov=60.0):
        """16:9; unrotated it looks along -Z. Angles in degrees: pitch up, yaw to the left."""
        camera = UsdGeom.Camera.Define(self.usd, "/World/Camera")
        camera.CreateHorizontalApertureAttr(36.0)
        camera.CreateVerticalApertureAttr(20.25)
        camera.CreateFocalLengthAttr(round(18.0 / math.tan(math.radians(horizontal_fov) / 2), 4))
        camera.CreateClippingRangeAttr(Gf.Vec2f(0.01, 1000.0))
        place(camera, position, (pitch, yaw, 0))
        return camera


def place(prim, translate, rotate=(0, 0, 0)):
    prim.AddTranslateOp().Set(Gf.Vec3d(*[round(v, 6) for v in translate]))
    if any(rotate):
        prim.AddRotateXYZOp().Set(Gf.Vec3f(*rotate))


# ---- the Cornell boxes -------------------------------------------------------------------------
# Width, height and depth; the opening faces +Z and has the camera's aspect ratio, so that the box fills the picture.

WIDTH, HEIGHT, DEPTH = 3.2, 1.8, 2.2
CEILING = HEIGHT - GAP


def cornell(stage):
    """Walls, and a camera before the opening whose picture the box fills."""
    stage.room("/World/Room", (-WIDTH / 2, 0, -DEPTH / 2), (WIDTH / 2, HEIGHT, DEPTH / 2), stage.matte("Red", RED),
               stage.matte("Green", GREEN), stage.matte("White", WHITE))
    distance = 2.6
    fov = 2 * math.degrees(math.atan(0.985 * WIDTH / 2 / distance))
    stage.camera((0, HEIGHT / 2, DEPTH / 2 + distance), horizontal_fov=fov)


def tall_block(stage, x=-0.55, z=-0.4):
    stage.standing("/World/TallBlock", x, z, (0.56, 1.1, 0.56), stage.materials["White"], turn=20)


def short_block(stage, x=0.5, z=0.2):
    stage.standing("/World/ShortBlock", x, z, (0.56, 0.56, 0.56), stage.materials["White"], turn=-18)


def cornell_empty():
    stage = Stage("cornell_empty", "A Cornell box with nothing in it but a lamp below the ceiling.")
    cornell(stage)
    stage.panel("/World/Lamp", (0, CEILING, 0), 0.8, 0.5, 24)
    return stage


def cornell_big_light():
    stage = Stage("cornell_big_light", "A Cornell box under a lamp nearly as large as the ceiling.")
    cornell(stage)
    tall_block(stage)
    short_block(stage)
    stage.panel("/World/Lamp", (0, CEILING, 0), 3.0, 2.0, 1.6)
    return stage


def cornell_glass():
    stage = Stage("cornell_glass", "A smooth glass sphere below a small lamp: a caustic on the floor.")
    cornell(stage)
    tall_block(stage, -0.95, -0.5)
    stage.sphere("/World/GlassSphere", (0.15, 0.6, 0.1), 0.36, stage.glass())
    stage.panel("/World/Lamp", (0.15, CEILING, 0.1), 0.36, 0.36, 80)
    return stage


def cornell_light_sphere():
    stage = Stage("cornell_light_sphere", "A Cornell box lit by a glowing sphere that floats inside.")
    cornell(stage)
    tall_block(stage)
    short_block(stage)
    stage.bulb("/World/Lamp", (-0.05, 1.1, 0.3), 0.13, 26)
    return stage


# ---- the darkening test ------------------------------------------------------------------------

CLOSED_DEPTH = 3.4


def closed_box(stage, path, x, z):
    """A box closed on all six sides, with its own lamp and blocks: nothing outside it can light it."""
    UsdGeom.Xform.Define(stage.usd, path).AddTranslateOp().Set(Gf.Vec3d(x, 0, z))
    white = stage.matte("White", WHITE)
    stage.room(f"{path}/Room", (-WIDTH / 2, 0, -DEPTH / 2), (WIDTH / 2, HEIGHT, CLOSED_DEPTH - DEPTH / 2),
               stage.matte("Red", RED), stage.matte("Green", GREEN), white, front=True)
    stage.standing(f"{path}/TallBlock", -0.55, -0.4, (0.56, 1.1, 0.56), white, turn=20)
    stage.standing(f"{path}/ShortBlock", 0.5, 0.2, (0.56, 0.56, 0.56), white, turn=-18)
    stage.panel(f"{path}/Lamp", (0, CEILING, 0), 0.8, 0.5, 18)


def boxes(name, description, places):
    stage = Stage(name, description)
    for index, (x, z) in enumerate(places):
        closed_box(stage, f"/World/Box{index}", x, z)
    stage.camera((0, HEIGHT / 2, CLOSED_DEPTH - DEPTH / 2 - 0.1), pitch=-4, horizontal_fov=76)
    return stage


def one_box():
    return boxes("one_box", "The darkening test: one closed box, seen from within.", [(0, 0)])


def five_boxes():
    return boxes("five_boxes",
                 "The darkening test: the view of one_box, with four more closed boxes out of sight. No light passes "
                 "between the boxes, so the two pictures are the same.",
                 [(0, 0), (-4, 0), (4, 0), (0, -4), (0, 4)])


# ---- the labyrinth -----------------------------------------------------------------------------
# Odd rows and columns are places, even ones the walls and doorways between them: # wall, . floor, * a bulb, o a panel on
# the first wall of the place.

MAZE = """
#####################
#o..#....o#..*..#..o#
#.#.#.###.#.###.#.#.#
#.#...#*#...#o#...#.#
#.#####.#####.#####.#
#..*..#..o..#....*#.#
#####.#.###.#.###.#.#
#o..#.#.#*..#.#o#...#
#.#.#.#.#.###.#.###.#
#.#...#.#..o..#...#.#
#.#####.#.#######.#.#
#..o..#*..#..o..#...#
#.###.#.#.#.###.###.#
#*#...#.#.....#..*..#
#.#.###.#####.#####.#
#...#o...........o..#
#####################
""".split()
PLACE, THICKNESS, MAZE_HEIGHT, LAMP_HEIGHT = 1.5, 0.2, 1.5, 0.9


def maze():
    stage = Stage("maze", "A labyrinth from above with 20 lamps: each place is lit by a few, the walls hide the others.")
    floor, top = stage.matte("Floor", (0.62, 0.57, 0.5)), stage.matte("Top", (0.32, 0.32, 0.34))
    walls = [stage.matte("Plaster", (0.76, 0.74, 0.7)), stage.matte("Terracotta", (0.68, 0.36, 0.24)),
             stage.matte("Slate", (0.34, 0.46, 0.6))]
    points, index, quads, materials = [], {}, [], []

    def line(i):
        """Coordinate of grid line i."""
        return i // 2 * (PLACE + THICKNESS) + i % 2 * THICKNESS

    def vertex(column, row, level):
        key = (column, row, level)
        if key not in index:
            index[key] = len(points)
            points.append((round(line(column), 6), level * MAZE_HEIGHT, round(line(row), 6)))
        return index[key]

    def quad(material, *corners):
        quads.append(tuple(vertex(*c) for c in corners))
        materials.append(material)

    # Walls around an open cell: the neighbour's place, and the two lower corners, seen from inside left to right.
    sides = [((0, -1), (0, 0), (1, 0)), ((-1, 0), (0, 1), (0, 0)), ((1, 0), (1, 0), (1, 1)), ((0, 1), (1, 1), (0, 1))]
    for r, cells in enumerate(MAZE):
        for c, kind in enumerate(cells):
            level = int(kind == "#")
            quad(top if level else floor, (c, r, level), (c, r + 1, level), (c + 1, r + 1, level), (c + 1, r, level))
            for (dc, dr), (ac, ar), (bc, br) in sides:
                if not level and MAZE[r + dr][c + dc] == "#":
                    quad(walls[(c // 7 + r // 6) % len(walls)], (c + ac, r + ar, 0), (c + bc, r + br, 0),
                         (c + bc, r + br, 1), (c + ac, r + ar, 1))
    stage.mesh("/World/Labyrinth", points, quads, materials)

    colors = [WARM, DAYLIGHT, (1.0, 0.66, 0.4), (0.8, 1.0, 0.85)]
    lamps = [(c, r, kind) for r, cells in enumerate(MAZE) for c, kind in enumerate(cells) if kind in "o*"]
    for count, (c, r, kind) in enumerate(lamps):
        x, z, color = line(c) + PLACE / 2, line(r) + PLACE / 2, colors[count % len(colors)]
        if kind == "*":
            stage.bulb(f"/World/Bulb{count}", (x, LAMP_HEIGHT, z), 0.12, 60, color)
            continue
        (dc, dr) = next(side for side, _, _ in sides if MAZE[r + side[1]][c + side[0]] == "#")
        turn = {(0, -1): 180, (-1, 0): -90, (1, 0): 90, (0, 1): 0}[dc, dr]
        reach = PLACE / 2 - GAP
        stage.panel(f"/World/Panel{count}", (x + reach * dc, LAMP_HEIGHT, z + reach * dr), 0.7, 0.4, 24, color, (0, turn, 0))
    stage.camera((line(21) / 2, 11.5, line(17) - 1.5), pitch=-65, horizontal_fov=66)
    return stage


# ---- the white room ----------------------------------------------------------------------------

def white_room():
    stage = Stage("white_room", "A bright room: white walls, furniture, a mirror, daylight through three windows.")
    wall, wood = stage.matte("Wall", (0.8, 0.8, 0.8)), stage.matte("Wood", (0.55, 0.38, 0.24))
    cloth, lacquer = stage.matte("Cloth", (0.3, 0.42, 0.55)), stage.matte("Lacquer", (0.82, 0.81, 0.78))
    brass, leaf = stage.matte("Ochre", (0.8, 0.55, 0.2)), stage.matte("Leaf", (0.2, 0.42, 0.15))
    width, height, depth = 6.0, 2.8, 5.0
    stage.room("/World/Room", (-width / 2, 0, -depth / 2), (width / 2, height, depth / 2), wall, wall, wall, front=True)
    stage.block("/World/Floorboards", (-width / 2 + 0.03, -SUNK, -depth / 2 + 0.03), (width / 2 - 0.03, 0.015, depth / 2 - 0.03),
                wood)

    for index, z in enumerate((-1.55, 0.0, 1.55)):
        stage.panel(f"/World/Window{index}", (-width / 2 + GAP, 1.55, z), 1.1, 1.5, 3.6, DAYLIGHT, rotate=(0, -90, 0))
        for bar, offset in enumerate((-0.57, 0.57)):
            stage.block(f"/World/Frame{index}_{bar}", (-width / 2 - SUNK, 0.76, z + offset - 0.015),
                        (-width / 2 + 0.06, 2.34, z + offset + 0.015), lacquer)
        stage.block(f"/World/Sill{index}", (-width / 2 - SUNK, 0.73, z - 0.6), (-width / 2 + 0.16, 0.77, z + 0.6), lacquer)

    stage.block("/World/Mirror", (0.75, 0.6, -depth / 2 - SUNK), (2.05, 2.2, -depth / 2 + 0.03), stage.mirror())
    for name, low, high in (("Top", (0.7, 2.19), (2.1, 2.25)), ("Bottom", (0.7, 0.55), (2.1, 0.61)),
                            ("Left", (0.69, 0.56), (0.76, 2.24)), ("Right", (2.04, 0.56), (2.11, 2.24))):
        stage.block(f"/World/MirrorFrame{name}", (*low, -depth / 2 - SUNK), (*high, -depth / 2 + 0.045), wood)
    stage.block("/World/Picture", (-1.75, 1.25, -depth / 2 - SUNK), (-0.85, 1.95, -depth / 2 + 0.04), brass)

    stage.block("/World/SofaSeat", (-2.3, 0.005, -2.2), (0.1, 0.42, -1.25), cloth)
    stage.block("/World/SofaBack", (-2.28, 0.4, -2.31), (0.08, 0.85, -1.98), cloth)
    stage.block("/World/SofaArmLeft", (-2.5, 0.004, -2.25), (-2.26, 0.62, -1.22), cloth)
    stage.block("/World/SofaArmRight", (0.06, 0.004, -2.25), (0.3, 0.62, -1.22), cloth)

    stage.block("/World/TableTop", (-1.7, 0.4, -0.6), (-0.3, 0.45, 0.2), lacquer)
    for index, (x, z) in enumerate(((-1.6, -0.5), (-0.4, -0.5), (-1.6, 0.1), (-0.4, 0.1))):
        stage.block(f"/World/TableLeg{index}", (x - 0.03, 0.005, z - 0.03), (x + 0.03, 0.42, z + 0.03), lacquer)
    stage.block("/World/Book", (-1.35, 0.445, -0.35), (-1.05, 0.5, -0.1), brass, turn=25)

    stage.block("/World/Cabinet", (2.45, 0.003, -1.3), (2.98, 0.8, 0.7), wood)
    stage.block("/World/Pot", (2.55, 0.79, 0.2), (2.85, 1.06, 0.5), stage.matte("Clay", (0.6, 0.28, 0.18)))
    stage.sphere("/World/Plant", (2.7, 1.25, 0.35), 0.27, leaf)
    stage.camera((2.2, 1.5, 2.3), pitch=-6, yaw=33, horizontal_fov=76)
    return stage


# ---- animation ---------------------------------------------------------------------------------

def torus(major, minor, around, across):
    """Points and quads of a faceted ring about the Y axis."""
    points, quads = [], []
    for i in range(around):
        a = 2 * math.pi * i / around
        for j in range(across):
            b = 2 * math.pi * j / across
            ring = major + minor * math.cos(b)
            points.append((round(ring * math.cos(a), 6), round(minor * math.sin(b), 6), round(-ring * math.sin(a), 6)))
            quads.append((i * across + j, (i + 1) % around * across + j, (i + 1) % around * across + (j + 1) % across,
                          i * across + (j + 1) % across))
    return points, quads


def animated():
    stage = Stage("animated", "A moving lamp, a turning ring and a moving camera: 24 frames, one second.")
    first, last = 1, 24
    stage.usd.SetStartTimeCode(first)
    stage.usd.SetEndTimeCode(last)
    stage.usd.SetTimeCodesPerSecond(24)
    cornell(stage)
    short_block(stage, 0.95, -0.35)
    points, quads = torus(0.42, 0.14, 24, 12)
    ring = stage.mesh("/World/Ring", points, quads, stage.matte("Ochre", (0.8, 0.52, 0.16)))
    ring_place, ring_turn = ring.AddTranslateOp(), ring.AddRotateXYZOp()
    ring_place.Set(Gf.Vec3d(-0.35, 0.72, -0.1))
    panel = stage.panel("/World/Panel", (0, CEILING, 0), 0.5, 0.5, 16)
    bulb = stage.bulb("/World/Bulb", (0, 0, 0), 0.07, 60, (0.75, 0.88, 1.0))
    bulb_place = bulb.GetPrim().GetAttribute("xformOp:translate")
    bulb_place.Clear()
    camera_place = stage.usd.GetPrimAtPath("/World/Camera").GetAttribute("xformOp:translate")
    camera_z = camera_place.Get()[2]
    camera_place.Clear()
    for frame in range(first, last + 1):
        t = (frame - first) / (last - first)
        ring_turn.Set(Gf.Vec3f(round(70 - 50 * t, 4), 0, round(180 * t, 4)), frame)
        bulb_place.Set(Gf.Vec3d(round(1.2 * math.cos(math.pi * t), 6), round(1.0 + 0.35 * math.sin(2 * math.pi * t), 6),
                                round(0.55 * math.sin(math.pi * t) - 0.1, 6)), frame)
        camera_place.Set(Gf.Vec3d(0, HEIGHT / 2, round(camera_z - 0.5 * t, 6)), frame)
        panel.GetIntensityAttr().Set(round(16 - 10 * t, 4), frame)
    return stage


STAGES = {f.__name__: f for f in (cornell_empty, cornell_big_light, cornell_glass, cornell_light_sphere, one_box, five_boxes,
                                  maze, white_room, animated)}


def main(names):
    unknown = [n for n in names if n not in STAGES]
    if unknown:
        sys.exit(f"generate.py: error: unknown stage {unknown[0]}: choose from {', '.join(STAGES)}")
    for name in names or STAGES:
        STAGES[name]().write()


if __name__ == "__main__":
    main(sys.argv[1:])
