"""An object and the occluder that the add-on makes of it, side by side, by Cycles on the processor.

python -m examples.castle castle.obj
.venv-blender/bin/python integrations/blender/picture.py castle.obj picture.png

The one in the docs was brought to 128 colours.
"""

import os
import sys
import tempfile
import zipfile
from pathlib import Path

HOME = tempfile.TemporaryDirectory()
os.environ["BLENDER_USER_RESOURCES"] = HOME.name  # read when bpy is imported

import bpy  # noqa: E402
from mathutils import Vector  # noqa: E402

_STONE, _GOLD, _INK, _GROUND = (0.55, 0.55, 0.58), (1, 0.55, 0.05), (0.05, 0.03, 0.01), (0.8,) * 3
_SIZE = 1100, 400


def main(source, target):
    install()
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    bpy.ops.wm.obj_import(filepath=source)
    original = bpy.context.object
    bpy.ops.object.transform_apply(rotation=True)
    bpy.context.scene.planar_occluder.ground = True
    bpy.ops.object.make_occluder()
    (occluder,) = original.children
    width = original.dimensions.x
    occluder.location.x = 1.25 * width
    occluder.hide_render = False
    paint(original, _STONE)
    edges = occluder.copy()
    edges.data = occluder.data.copy()
    bpy.context.scene.collection.objects.link(edges)
    edges.modifiers.new("edges", "WIREFRAME").thickness = 0.004 * width
    paint(occluder, _GOLD)
    paint(edges, _INK)
    bpy.ops.mesh.primitive_plane_add(size=100.0 * width)
    paint(bpy.context.object, _GROUND)
    light()
    look(Vector((0.625 * width, 0.0, 0.05 * width)), 4.3 * width)
    render(target)


def install():
    source, archive = Path(__file__).parent / "planar_occluder", Path(HOME.name, "add_on.zip")
    with zipfile.ZipFile(archive, "w") as pack:
        for path in source.glob("*.*"):
            pack.write(path, path.name)
    bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True
    )


def paint(item, colour):
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    item.data.materials.clear()
    item.data.materials.append(material)


def light():
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.25, 0.5))
    bpy.context.object.data.energy = 3.0
    world = bpy.context.scene.world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.45, 0.5, 0.6, 1.0)


def look(target, distance):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.scene.collection.objects.link(camera)
    camera.data.lens, camera.data.clip_end = 60.0, 10.0 * distance
    away = Vector((-0.1, -0.9, 0.45)).normalized()
    camera.location = target + distance * away
    camera.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.camera = camera


def render(target):
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = 48, True
    scene.render.resolution_x, scene.render.resolution_y = _SIZE
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.compression = 100
    scene.render.filepath = str(Path(target).resolve())
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
