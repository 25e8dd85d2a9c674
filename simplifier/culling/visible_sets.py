"""Scene + Pvs -> VisibleSets: what of the scene a viewer may see, by sets that are its own.

Do these sets belong to this scene?
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import SceneError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.pvs import Pvs
from simplifier.geometry.scene import Scene
from simplifier.geometry.solid import BoolArray
from simplifier.hierarchy.node_plan import mesh_key


def scene_digest(scene: Scene, opaque: Scene | None = None) -> bytes:
    """8 bytes of the objects' names, shapes and places, and of what of them is opaque.

    ``opaque``  by default the scene itself.
    """
    whole = _digest(scene)
    hiding = whole if opaque is None or opaque is scene else _digest(opaque)
    return whole if hiding == whole else hashlib.blake2b(whole + hiding, digest_size=8).digest()


def _digest(scene: Scene) -> bytes:
    made = hashlib.blake2b(digest_size=8)
    for mesh in scene.meshes:
        made.update(mesh_key(mesh))
    made.update(np.ascontiguousarray(scene.mesh_of).data)
    made.update(np.ascontiguousarray(scene.transforms).data)
    made.update("\0".join(scene.names).encode())
    return bytes(made.digest())


def check_sets(pvs: Pvs, scene: Scene, opaque: Scene | None = None) -> None:
    """Raise :class:`SceneError` where the sets were found in another scene.

    ``opaque``  as for :func:`scene_digest`.
    """
    if pvs.scene != scene_digest(scene, opaque):
        raise SceneError(
            "these are the visible sets of another scene, of an earlier state of this one, or by"
            " another --transparent",
            remedy="find them again with 'occluder pvs'",
        )


@dataclass(frozen=True, eq=False)
class VisibleSets:
    """Visible sets of view cells, which are certainly of the scene that is drawn.

    ``places``  (n,) int64: of each object that is drawn among those of the sets; -1 for one that
                they do not know, which is always visible.
    """

    pvs: Pvs
    places: NDArray[np.int64]

    @classmethod
    def of(cls, pvs: Pvs, scene: Scene, drawn: Scene, hiding: Scene | None = None) -> VisibleSets:
        """``scene`` is that of the sets, ``drawn`` what of it is opaque, perhaps all of it, and
        ``hiding`` what of that hides anything, by default all.

        Raises :class:`SceneError` as :func:`check_sets` does.
        """
        check_sets(pvs, scene, drawn if hiding is None else hiding)
        known = {name: place for place, name in enumerate(pvs.names)}
        places = [known.get(name, -1) for name in drawn.names]
        return cls(pvs, np.array(places, dtype=np.int64))

    def seen_from(self, point: FloatArray) -> BoolArray:
        """(n,) which of the drawn objects may be seen from a world point (3,)."""
        return np.append(self.pvs.visible(point), True)[self.places]

    def holds(self, point: FloatArray) -> bool:
        """Whether a world point (3,) is in a cell; from outside of all everything may be seen."""
        return len(self.pvs.cells.containing(self.pvs.to_cells(point))) > 0
