"""Reads a USD stage as a Mitsuba 3 scene, by the meaning that Trilume's contracts give each schema.

Independent of Trilume's own reader on purpose: agreement of the two pictures then says something about both. What cannot
be compared exactly (rough lobes with energy compensation, textures, lens blur, ...) raises `NotComparable`.
"""

import math

import mitsuba as mi
import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade


class NotComparable(Exception):
    """The stage uses something that Mitsuba does not compute in exactly the same way."""


def load(path, width, height, time=None):
    """A Mitsuba scene of the stage at `path`, seen by its only camera.

    width, height: pixels; must have the aspect ratio of the camera's aperture.
    time: time code; None is the stage's start, or the default time.
    """
    return mi.load_dict(to_dict(Usd.Stage.Open(str(path)), width, height, time))


def to_dict(stage, width, height, time=None):
    if time is None and stage.HasAuthoredTimeCodeRange():
        time = stage.GetStartTimeCode()
    return _Converter(stage, Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)).scene(width, height)


class _Converter:
    def __init__(self, stage, time):
        self.stage, self.time = stage, time
        self.xforms = UsdGeom.XformCache(time)
        # World space is metres and Y up.
        scale = UsdGeom.GetStageMetersPerUnit(stage)
        self.metres = np.diag([scale, scale, scale, 1.0])
        if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
            self.metres = self.metres @ np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
        self.bsdfs = {}

    def scene(self, width, height):
        # Unbounded paths: Russian roulette alone ends them, so that no energy is cut.
        scene = {"type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8}}
        cameras = 0
        for prim in Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
            imageable = UsdGeom.Imageable(prim)
            if not imageable or prim.IsA(UsdGeom.PointInstancer):
                if prim.IsA(UsdGeom.PointInstancer):
                    raise NotComparable(f"{prim.GetPath()}: point instancers")
                continue
            if prim.IsA(UsdGeom.Camera):
                cameras += 1
                scene["sensor"] = self.camera(UsdGeom.Camera(prim), width, height)
                continue
            if imageable.ComputeVisibility(self.time) == UsdGeom.Tokens.invisible:
                continue
            if imageable.ComputePurpose() not in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render):
                continue
            for index, part in enumerate(self.parts(prim)):
                scene[f"{prim.GetPath().pathString.replace('/', '_')}_{index}"] = part
        if cameras != 1:
            raise NotComparable(f"{cameras} cameras where one is meant")
        return scene

    def parts(self, prim):
        """Mitsuba shapes and emitters of one prim."""
        if prim.IsA(UsdGeom.Mesh):
            return self.mesh(UsdGeom.Mesh(prim))
        if prim.IsA(UsdGeom.Sphere):
            return [self.sphere(UsdGeom.Sphere(prim))]
        if prim.IsA(UsdGeom.Gprim):
            raise NotComparable(f"{prim.GetPath()}: {prim.GetTypeName()}")
        if prim.HasAPI(UsdLux.LightAPI):
            return [self.light(prim)]
        return []

    def world(self, prim):
        """4x4, column vectors, metres."""
        return self.metres @ np.array(self.xforms.GetLocalToWorldTransform(prim)).T

    def value(self, attribute):
        return attribute.Get(self.time)

    # ---- shapes ----

    def mesh(self, mesh):
        prim = mesh.GetPrim()
        if self.value(mesh.GetSubdivisionSchemeAttr()) != UsdGeom.Tokens.none:
            raise NotComparable(f"{prim.GetPath()}: subdivision surfaces")
        if mesh.GetNormalsAttr().HasAuthoredValue() or UsdGeom.PrimvarsAPI(prim).HasPrimvar("normals"):
            raise NotComparable(f"{prim.GetPath()}: shading normals")
        points = np.array(self.value(mesh.GetPointsAttr()), dtype=np.float64)
        counts = np.array(self.value(mesh.GetFaceVertexCountsAttr()))
        indices = np.array(self.value(mesh.GetFaceVertexIndicesAttr()))
        world = self.world(prim)
        points = points @ world[:3, :3].T + world[:3, 3]
        flip = self.value(mesh.GetOrientationAttr()) == UsdGeom.Tokens.leftHanded
        flip ^= bool(np.linalg.det(world[:3, :3]) < 0)

        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        bound = {}
        subset_of = np.full(len(counts), -1)
        for number, subset in enumerate(UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()):
            subset_of[np.array(self.value(subset.GetIndicesAttr()))] = number
            bound[number] = subset.GetPrim()
        bound[-1] = prim
        shapes = []
        for number in np.unique(subset_of):
            triangles = []
            for face in np.nonzero(subset_of == number)[0]:
                corners = indices[starts[face]:starts[face] + counts[face]]
                if flip:
                    corners = corners[::-1]
                triangles += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
            shapes.append(self.triangles(prim, bound[int(number)], points, np.array(triangles)))
        return shapes

    def triangles(self, prim, bound, points, triangles):
        bsdf, emission = self.material(bound)
        if prim.HasAPI(UsdLux.MeshLightAPI):
            emission = self.radiance(UsdLux.LightAPI(prim))
        properties = mi.Properties()
        properties["mesh_bsdf"] = bsdf
        if emission is not None:
            properties["mesh_emitter"] = mi.load_dict({"type": "area", "radiance": _rgb(emission)})
        mesh = mi.Mesh(str(prim.GetPath()), len(points), len(triangles), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = points.astype(np.float32).ravel()
        parameters["faces"] = triangles.astype(np.uint32).ravel()
        parameters.update()
        return mesh

    def sphere(self, sphere):
        prim = sphere.GetPrim()
        bsdf, emission = self.material(prim)
        shape = {"type": "sphere", "bsdf": bsdf, **self.ball(prim, self.value(sphere.GetRadiusAttr()))}
        if emission is not None:
            shape["emitter"] = {"type": "area", "radiance": _rgb(emission)}
        return shape

    def ball(self, prim, radius):
        world = self.world(prim)
        return {"center": world[:3, 3].tolist(), "radius": radius * self.uniform_scale(prim, world)}

    def uniform_scale(self, prim, world):
        scales = np.linalg.norm(world[:3, :3], axis=0)
        if np.ptp(scales) > 1e-6 * scales.max():
            raise NotComparable(f"{prim.GetPath()}: a stretched sphere or cylinder")
        return float(scales.mean())

    # ---- lights ----

    def radiance(self, light, area=1.0):
        """W/(m^2 sr), or W/m^2 for a distant light of angle 0; `area` in m^2, used by `normalize`."""
        get = lambda attribute: self.value(attribute)
        value = np.array(get(light.GetColorAttr()), dtype=np.float64)
        value *= get(light.GetIntensityAttr()) * 2.0 ** get(light.GetExposureAttr())
        if get(light.GetEnableColorTemperatureAttr()):
            value *= np.array(UsdLux.BlackbodyTemperatureAsRgb(get(light.GetColorTemperatureAttr())))
        if get(light.GetNormalizeAttr()):
            value /= area
        return value

    def light(self, prim):
        light = UsdLux.LightAPI(prim)
        kind = prim.GetTypeName()
        world = self.world(prim)
        # Mitsuba's rectangle and disk shine along +Z, USD's along -Z.
        turned = world @ np.diag([-1.0, 1.0, -1.0, 1.0])
        if kind == "RectLight":
            rect = UsdLux.RectLight(prim)
            if rect.GetTextureFileAttr().HasAuthoredValue():
                raise NotComparable(f"{prim.GetPath()}: textured rectangle light")
            w, h = self.value(rect.GetWidthAttr()), self.value(rect.GetHeightAttr())
            area = w * h * np.linalg.norm(np.cross(world[:3, 0], world[:3, 1]))
            shape = {"type": "rectangle", "to_world": _transform(turned @ np.diag([w / 2, h / 2, 1, 1]))}
        elif kind == "DiskLight":
            r = self.value(UsdLux.DiskLight(prim).GetRadiusAttr())
            area = math.pi * r * r * np.linalg.norm(np.cross(world[:3, 0], world[:3, 1]))
            shape = {"type": "disk", "to_world": _transform(turned @ np.diag([r, r, 1, 1]))}
        elif kind == "SphereLight":
            shape = {"type": "sphere", **self.ball(prim, self.value(UsdLux.SphereLight(prim).GetRadiusAttr()))}
            area = 4 * math.pi * shape["radius"] ** 2
        elif kind == "CylinderLight":
            cylinder = UsdLux.CylinderLight(prim)
            scale = self.uniform_scale(prim, world)
            radius, half = self.value(cylinder.GetRadiusAttr()) * scale, self.value(cylinder.GetLengthAttr()) / 2
            shape = {"type": "cylinder", "radius": radius, "p0": (world @ [-half, 0, 0, 1])[:3].tolist(),
                     "p1": (world @ [half, 0, 0, 1])[:3].tolist()}
            area = 4 * math.pi * radius * half * scale
        elif kind == "DistantLight":
            if self.value(UsdLux.DistantLight(prim).GetAngleAttr()) != 0:
                raise NotComparable(f"{prim.GetPath()}: a distant light with an extent")
            return {"type": "directional", "direction": (-world[:3, 2]).tolist(),
                    "irradiance": _rgb(self.radiance(light))}
        elif kind == "DomeLight":
            return self.dome(UsdLux.DomeLight(prim), light, world)
        else:
            raise NotComparable(f"{prim.GetPath()}: {kind}")
        shape["emitter"] = {"type": "area", "radiance": _rgb(self.radiance(light, area))}
        shape["bsdf"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
        return shape

    def dome(self, dome, light, world):
        texture = self.value(dome.GetTextureFileAttr())
        if not texture:
            return {"type": "constant", "radiance": _rgb(self.radiance(light))}
        # Both conventions put the image's centre at +Z and its left half toward +X, with +Y up.
        pixels = np.array(mi.Bitmap(texture.resolvedPath).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))
        pixels = pixels * self.radiance(light).astype(np.float32)
        rotation = np.eye(4)
        rotation[:3, :3] = world[:3, :3] / np.linalg.norm(world[:3, :3], axis=0)
        return {"type": "envmap", "bitmap": mi.Bitmap(pixels), "to_world": _transform(rotation)}

    # ---- materials ----

    def material(self, prim):
        """(BSDF, emitted radiance or None) of the material bound to `prim`."""
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        if not material:
            raise NotComparable(f"{prim.GetPath()}: no material")
        path = material.GetPath()
        if path not in self.bsdfs:
            surface = material.ComputeSurfaceSource()[0]
            if not surface or surface.GetIdAttr().Get() != "UsdPreviewSurface":
                raise NotComparable(f"{path}: not a UsdPreviewSurface")
            bsdf, emission = self.preview_surface(path, surface)
            self.bsdfs[path] = self.loaded(bsdf), emission
        return self.bsdfs[path]

    def loaded(self, bsdf):
        return mi.load_dict(bsdf)

    def preview_surface(self, path, shader):
        def read(name, default):
            shader_input = shader.GetInput(name)
            if not shader_input:
                return default
            if shader_input.HasConnectedSource():
                raise NotComparable(f"{path}: {name} is connected")
            value = self.value(shader_input)
            return default if value is None else value

        color = np.array(read("diffuseColor", (0.18, 0.18, 0.18)), dtype=np.float64)
        metallic, roughness, ior = read("metallic", 0.0), read("roughness", 0.5), read("ior", 1.5)
        opacity = read("opacity", 1.0)
        emissive = np.array(read("emissiveColor", (0.0, 0.0, 0.0)), dtype=np.float64)
        if read("useSpecularWorkflow", 0) or read("clearcoat", 0.0):
            raise NotComparable(f"{path}: specular workflow or clearcoat")
        if opacity == 1 and metallic == 0 and ior == 1:
            bsdf = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": _rgb(color)}}
        elif opacity == 1 and metallic == 1 and roughness == 0 and (color == 1).all():
            bsdf = {"type": "twosided", "nested": {"type": "conductor", "material": "none"}}
        elif opacity == 0 and metallic == 0 and roughness == 0 and read("opacityMode", "transparent") == "transparent":
            bsdf = {"type": "dielectric", "int_ior": float(ior), "ext_ior": 1.0, "specular_transmittance": _rgb(color)}
        else:
            raise NotComparable(f"{path}: neither Lambert (ior 1), a white mirror nor smooth glass")
        return bsdf, (emissive if emissive.any() else None)

    # ---- camera ----

    def camera(self, camera, width, height):
        prim = camera.GetPrim()
        horizontal, vertical = self.value(camera.GetHorizontalApertureAttr()), self.value(camera.GetVerticalApertureAttr())
        focal = self.value(camera.GetFocalLengthAttr())
        if self.value(camera.GetFStopAttr()):
            raise NotComparable(f"{prim.GetPath()}: lens blur")
        if abs(width / height * vertical / horizontal - 1) > 1e-4:
            raise NotComparable(f"{prim.GetPath()}: {width}x{height} is not the aperture's aspect ratio")
        world = self.world(prim)
        frame = np.eye(4)
        frame[:3, :3] = world[:3, :3] / np.linalg.norm(world[:3, :3], axis=0)
        frame[:3, 3] = world[:3, 3]
        near, far = self.value(camera.GetClippingRangeAttr())
        unit = float(self.metres[0, 0])
        return {
            "type": "perspective",
            # Mitsuba's camera looks along +Z with +X to the left.
            "to_world": _transform(frame @ np.diag([-1.0, 1.0, -1.0, 1.0])),
            "fov_axis": "x",
            "fov": math.degrees(2 * math.atan(horizontal / (2 * focal))),
            # An offset moves the window right and up, so the optical axis left and down in the picture. Mitsuba counts
            # the same way along x and the other way along y.
            "principal_point_offset_x": self.value(camera.GetHorizontalApertureOffsetAttr()) / horizontal,
            "principal_point_offset_y": -self.value(camera.GetVerticalApertureOffsetAttr()) / vertical,
            "near_clip": near * unit,
            "far_clip": far * unit,
            "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
            "sampler": {"type": "multijitter", "sample_count": 64},
        }


def _rgb(value):
    return {"type": "rgb", "value": [float(v) for v in np.broadcast_to(value, 3)]}


def _transform(matrix):
    return mi.ScalarTransform4f(np.asarray(matrix, dtype=np.float64).tolist())
