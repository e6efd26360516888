"""Cycles on the same stages and cores, in a process of its own that needs bpy and NumPy alone:
python -I render_cycles.py SCENE.json WIDTH HEIGHT SECONDS SEED OUT.npz, the scene by usd_to_cycles.

Takes four times the samples per pixel until a picture takes SECONDS. What Cycles keeps from picture to picture is left out:
each is rendered twice, and the second is timed.
"""

import json
import math
import os
import sys
import tempfile
import time

import bpy
import numpy as np


def material(part):
    result = bpy.data.materials.new("material")
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    if part["emission"] is not None:
        # The front alone shines; the back is black.
        node, facing = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeNewGeometry")
        front = tree.nodes.new("ShaderNodeMath")
        front.operation = "SUBTRACT"
        front.inputs[0].default_value = 1.0
        tree.links.new(facing.outputs["Backfacing"], front.inputs[1])
        tree.links.new(front.outputs[0], node.inputs["Strength"])
        node.inputs["Color"].default_value = (*part["emission"], 1.0)
        result.cycles.emission_sampling = "FRONT"
    elif part["bsdf"]["type"] == "diffuse":
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*np.broadcast_to(part["bsdf"]["color"], 3), 1.0)
    elif part["bsdf"]["type"] == "mirror":
        node = tree.nodes.new("ShaderNodeBsdfAnisotropic")
        node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        node.inputs["Roughness"].default_value = 0.0
    else:
        node = tree.nodes.new("ShaderNodeBsdfGlass")
        node.inputs["Color"].default_value = (*np.broadcast_to(part["bsdf"]["color"], 3), 1.0)
        node.inputs["Roughness"].default_value = 0.0
        node.inputs["IOR"].default_value = part["bsdf"]["ior"]
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return result


def add(part):
    if part["kind"] == "sphere":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=part["radius"], location=part["center"])
        thing = bpy.context.active_object
        thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
    else:
        mesh = bpy.data.meshes.new("mesh")
        mesh.from_pydata(part["points"], [], part["triangles"])
        thing = bpy.data.objects.new("mesh", mesh)
        bpy.context.collection.objects.link(thing)
    thing.data.materials.append(material(part))


def build(scene, width, height):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    for part in scene["parts"]:
        add(part)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    # What is assigned to matrix_world is read column by column.
    camera.matrix_world = np.array(scene["camera"]["to_world"]).T.tolist()
    camera.data.sensor_fit, camera.data.angle = "HORIZONTAL", math.radians(scene["camera"]["fov"])
    camera.data.clip_start, camera.data.clip_end = scene["camera"]["near"], scene["camera"]["far"]
    bpy.context.scene.camera = camera
    bpy.context.scene.world = bpy.data.worlds.new("black")
    bpy.context.scene.world.use_nodes = True
    bpy.context.scene.world.node_tree.nodes.clear()

    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = "CYCLES", width, height, 100
    render.threads_mode, render.threads = "FIXED", len(os.sched_getaffinity(0))
    render.use_persistent_data = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    # Expected radiance as it is: no filter wider than a pixel, no clamp, no path cut short but by Russian roulette.
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    cycles.pixel_filter_type, cycles.blur_glossy, cycles.light_sampling_threshold = "BOX", 0.0, 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    for kind in ("", "diffuse_", "glossy_", "transmission_", "transparent_max_"):
        setattr(cycles, f"{kind}bounces" if kind else "max_bounces", 1024)
    cycles.caustics_reflective = cycles.caustics_refractive = True
    return bpy.context.scene


def picture(scene, folder):
    path = os.path.join(folder, "picture.exr")
    bpy.data.images["Render Result"].save_render(path, scene=scene)
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)[::-1, :, :3].copy()


def main():
    path, width, height, seconds, seed, output = sys.argv[1:]
    with open(path) as file:
        scene = build(json.load(file), int(width), int(height))
    spp, spps, times, images = 1, [], [], []
    with tempfile.TemporaryDirectory(prefix="trilume-bench-") as folder:
        while not times or times[-1] < 1e3 * float(seconds):
            scene.cycles.samples = spp
            for timed in (False, True):
                if timed or len(times) < 2 or times[-1] < 500:
                    scene.cycles.seed = 2 * int(seed) + timed
                    begun = time.monotonic()
                    bpy.ops.render.render()
            spps.append(spp)
            times.append(1e3 * (time.monotonic() - begun))
            images.append(picture(scene, folder))
            spp *= 4
    np.savez(output, spp=spps, ms=times, images=images, renderer=f"Cycles of Blender {bpy.app.version_string}")


main()
