"""Small scenes, z up, with occluders made by hand: what they hide is known."""

from __future__ import annotations

import numpy as np

from simplifier.culling.visible_sets import scene_digest
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.pvs import UNKNOWN, Pvs, pack_rows
from simplifier.geometry.view_cells import ViewCells
from simplifier.hierarchy.occluder_tree import FAR, NEAR, OccluderTree
from simplifier.hierarchy.parts import split_large
from simplifier.hierarchy.tree import build_tree
from simplifier.options.scene import CullOptions, SceneOptions
from tests.solids import box, joined
from tests.walkable import scene_of

SMALL = CullOptions((80, 45), repeats=1)

WALL = box((12.0, 0.2, 8.0), (-6.0, 0.0, 0.0))
PANE = ((5.0, 2.0), (2.0, 3.0))
"""Where the wall with a window is open: its low corner from the wall's, and its size; x and z."""

HIDDEN = [f"behind {i}" for i in range(4)]


def wall_with_window():
    """The same wall, open for 2 x 3 in the middle."""
    (x, z), (width, height) = PANE
    sides = [box((x, 0.2, 8.0), (-6.0, 0.0, 0.0)),
             box((12.0 - x - width, 0.2, 8.0), (-6.0 + x + width, 0.0, 0.0)),
             box((width, 0.2, z), (-6.0 + x, 0.0, 0.0)),
             box((width, 0.2, 8.0 - z - height), (-6.0 + x, 0.0, z + height))]  # fmt: skip
    return joined(*sides)


def street(wall=WALL):
    """A wall, four boxes behind it, one beside it, and one behind the camera."""
    behind = [box((1.0, 1.0, 1.0), (x, 6.0, 2.5)) for x in (-4.0, -0.5, 2.0, 3.5)]
    others = [box((1.0, 1.0, 1.0), (8.0, 3.0, 1.0)), box((1.0, 1.0, 1.0), (0.0, -30.0, 0.0))]
    return scene_of(wall, *behind, *others, names=["wall", *HIDDEN, "beside", "at the back"])


def looking(position=(0.0, -10.0, 3.0), forward=(0.0, 1.0, 0.0), fov=60.0):
    return Camera.looking(
        np.array(position), np.array(forward), np.array([0.0, 0.0, 1.0]), fov, 0.1
    )


def path_of(*cameras):
    return CameraPath("by hand", cameras or (looking(),))


def exact(mesh):
    """What a mesh is, as an occluder."""
    return Occluder(mesh.vertices, mesh.faces, 0.0)


def tree_of(scene, occluders, **options):
    """The occluders of objects, by name; exact ones are near, others far ones of a leaf."""
    parts = split_large(scene)
    tree = build_tree(parts.bounds, 8)
    made = list(occluders.values())
    places = {name: index for index, name in enumerate(occluders)}
    occluder_of = np.full((len(tree), 2), -1, dtype=np.int32)
    for leaf in np.nonzero(tree.is_leaf)[0]:
        part = tree.order[tree.spans[leaf, 0]]
        place = places.get(scene.names[parts.object_of[part]], -1)
        if place >= 0:
            level = NEAR if made[place].error_bound == 0.0 else FAR
            occluder_of[leaf, level] = place
    return OccluderTree(
        SceneOptions(**options), scene.names, parts.object_of, tree,
        parts.scene.transforms, occluder_of, tuple(made), np.full(len(made), 1e3),
    )  # fmt: skip


CELLS = ViewCells.boxes(
    np.array([[-2.0, -12, 0], [2, -12, 0]]), np.array([[2.0, -8, 4], [9, -8, 4]])
)


def sets_of(scene, *visible, opaque=None):
    """Sets of named objects for the first of two cells before the wall; others are not computed."""
    rows, places = pack_rows(np.isin(scene.names, names) for names in visible)
    row_of = np.full(len(CELLS), UNKNOWN, dtype=np.int64)
    row_of[: len(places)] = places
    return Pvs(
        "z", np.zeros(3), scene.names, np.arange(len(scene), dtype=np.int32), CELLS, rows, row_of,
        "cull-map", True, scene_digest(scene, opaque), bytes(8),
    )  # fmt: skip
