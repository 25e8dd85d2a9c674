"""Occluders drawn over the scene, as translucent triangles with their edges."""

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .geometry import is_occluder

_FILL = (1.0, 0.75, 0.1, 0.25)
_EDGE = (1.0, 0.75, 0.1, 0.9)

_handler = None


def show(wanted):
    """Draw from now on, or no more."""
    global _handler
    if wanted and _handler is None:
        _handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    elif not wanted and _handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handler, "WINDOW")
        _handler = None
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def is_shown():
    return _handler is not None


def shapes(context):
    """World positions (n, 3), triangles (m, 3) and edges (k, 2) of each visible occluder."""
    for item in context.visible_objects:
        if is_occluder(item) and item.type == "MESH":
            mesh = item.data
            mesh.calc_loop_triangles()
            points = [item.matrix_world @ vertex.co for vertex in mesh.vertices]
            triangles = [tuple(one.vertices) for one in mesh.loop_triangles]
            yield np.array(points), triangles, [tuple(edge.vertices) for edge in mesh.edges]


def _draw():
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")
    for points, triangles, edges in shapes(bpy.context):
        for kind, indices, colour in (("TRIS", triangles, _FILL), ("LINES", edges, _EDGE)):
            batch = batch_for_shader(shader, kind, {"pos": points.tolist()}, indices=indices)
            shader.uniform_float("color", colour)
            batch.draw(shader)
    gpu.state.blend_set("NONE")


@bpy.app.handlers.persistent
def _follow_file(*_):
    """A file that was opened says itself whether there is a preview."""
    show(bpy.context.scene.planar_occluder.preview)


def register():
    bpy.app.handlers.load_post.append(_follow_file)


def unregister():
    bpy.app.handlers.load_post.remove(_follow_file)
    show(False)
