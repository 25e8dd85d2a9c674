"""Do these occluders belong to this scene?"""

from __future__ import annotations

from itertools import zip_longest

import numpy as np

from simplifier.errors import SceneError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import Scene
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.parts import Parts, split_large

_TOLERANCE = 1e-6  # of the scene's extent: a box may pass through a file


def parts_of(scene: Scene, tree: OccluderTree) -> Parts:
    """The parts that the occluders were made for.

    Raises :class:`SceneError` where objects, their parts or the parts' boxes are not those of the
    tree: occluders of another scene, or of an earlier state of this one, would hide at random.
    """
    for index, (here, there) in enumerate(zip_longest(scene.names, tree.objects)):
        if here != there:
            raise _foreign(f"object {index} is {_named(here)} here and {_named(there)} there")
    parts = split_large(scene)
    if not np.array_equal(parts.object_of, tree.object_of):
        raise _foreign(f"{len(parts.object_of)} parts here and {len(tree.object_of)} there")
    boxes, built = parts.scene.bounds(), _part_boxes(tree)
    extent = float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())
    off = np.abs(boxes - built).max(axis=(1, 2))
    worst = int(np.argmax(off))
    if not off[worst] <= _TOLERANCE * extent:
        name = scene.names[parts.object_of[worst]]
        raise _foreign(f"the box of '{name}' is off by {off[worst]:.3g}")
    return parts


def _part_boxes(tree: OccluderTree) -> FloatArray:
    """(p, 2, 3) of the leaves, by part."""
    leaves = np.nonzero(tree.tree.is_leaf)[0]
    boxes = np.empty((len(leaves), 2, 3))
    boxes[tree.tree.order[tree.tree.spans[leaves, 0]]] = tree.tree.bounds[leaves]
    return boxes


def _named(name: str | None) -> str:
    return "missing" if name is None else f"'{name}'"


def _foreign(how: str) -> SceneError:
    return SceneError(
        f"these are the occluders of another scene ({how})",
        remedy="build them again with 'occluder scene'",
    )
