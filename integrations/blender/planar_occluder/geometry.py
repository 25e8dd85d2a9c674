"""Objects to triangles, and triangles to an object."""

from collections import Counter
from functools import cache

import bpy
import numpy as np

from .materials import is_see_through

MARK = "planar_occluder"
"""Custom property of the objects that are occluders; it holds their figures."""

_SHAPED = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


def is_occluder(item):
    return MARK in item


def occluder_of(item):
    """The occluder among an object's children, or None."""
    return next(filter(is_occluder, item.children), None)


def frame_of(item):
    """Transform (4, 4) from an object's space to the frame that its occluder is made in.

    Axes and lengths of that frame are the world's, so that up is z and a length is one in the
    scene whatever the object's scale; its origin is the object's, which keeps numbers small.
    """
    frame = _array(item.matrix_world)
    frame[:3, 3] = 0.0
    return frame


def triangles_of(context, members, anchor, transparent):
    """Vertices (n, 3) and faces (m, 3) of objects as they are shown, in ``anchor``'s frame.

    With modifiers, and with whatever they instance: collections, points, geometry nodes.
    Occluders among them are left out, and by ``transparent``, "leave-out" or "keep", what one can
    see through: last of the result are the counts of those triangles by their material's name.
    """
    origin = np.array(anchor.matrix_world.translation)
    is_clear = cache(is_see_through)  # instances share materials
    vertices, faces, count, omitted = [], [], 0, Counter()
    for instance in context.evaluated_depsgraph_get().object_instances:
        source = instance.parent if instance.is_instance else instance.object
        shown = instance.is_instance or instance.show_self
        shape = instance.object
        if source.original not in members or not shown or shape.type not in _SHAPED:
            continue
        if is_occluder(shape.original):
            continue
        points, corners, slots = _mesh_arrays(shape)
        if transparent == "leave-out":
            corners = corners[~_clear(shape, slots, is_clear, omitted)]
        matrix = _array(instance.matrix_world)
        matrix[:3, 3] -= origin
        vertices.append(_moved(points, matrix))
        faces.append(_outward(corners, matrix) + count)
        count += len(points)
    if not count:
        return np.empty((0, 3)), np.empty((0, 3), np.int32), omitted
    return np.concatenate(vertices), np.concatenate(faces), omitted


def attach(context, anchor, frame, triangles, name, figures):
    """Make vertices and faces of a frame of the anchor its child; one that is there is replaced.

    The child has no transform of its own: its vertices are in the anchor's space.
    """
    vertices, faces = triangles
    local = _moved(vertices, np.linalg.inv(frame))
    faces = _outward(faces, frame)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(local.tolist(), [], faces.tolist())
    child = occluder_of(anchor)
    if child is None:
        child = bpy.data.objects.new(name, mesh)
        child.parent = anchor
        child.display_type = "WIRE"
        child.hide_render = True
        _home(context, anchor).objects.link(child)
    else:
        old, child.data = child.data, mesh
        if not old.users:
            bpy.data.meshes.remove(old)
        child.name = name
        mesh.name = name
    child[MARK] = figures
    return child


def _home(context, anchor):
    """A collection of the anchor that can be changed."""
    own = (one for one in anchor.users_collection if one.is_editable)
    return next(own, context.scene.collection)


def _clear(shape, slots, is_clear, omitted):
    """Which triangles (m,) have a material that is clear; they are counted by its name."""
    clear = np.zeros(len(slots), bool)
    slots = np.minimum(slots, len(shape.material_slots) - 1)  # as Blender draws what is past them
    for index, slot in enumerate(shape.material_slots):
        if is_clear(slot.material) and (own := slots == index).any():
            clear |= own
            omitted[slot.material.name] += int(own.sum())
    return clear


def _mesh_arrays(shape):
    """Vertices (n, 3) and corners (m, 3) in the object's space, and the triangles' slots (m,)."""
    mesh = shape.to_mesh()
    try:
        mesh.calc_loop_triangles()
        points = np.empty(3 * len(mesh.vertices), np.float32)
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        slots = np.empty(len(mesh.loop_triangles), np.int32)
        mesh.vertices.foreach_get("co", points)
        mesh.loop_triangles.foreach_get("vertices", corners)
        mesh.loop_triangles.foreach_get("material_index", slots)
    finally:
        shape.to_mesh_clear()
    return points.reshape(-1, 3).astype(np.float64), corners.reshape(-1, 3), slots


def _array(matrix):
    return np.array(matrix, dtype=np.float64)


def _outward(faces, matrix):
    """Faces of what a matrix moves, wound as before also where it mirrors."""
    return faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else faces


def _moved(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]
