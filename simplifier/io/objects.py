"""Objects as a file states them, before any is checked.

Names that each stand for one object.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

RawMesh = tuple[FloatArray, NDArray[np.int64]]
"""Vertices (n, 3) float64 and faces (m, 3) of a file, either possibly empty or wrong."""


@dataclass(frozen=True, eq=False)
class Objects:
    """Meshes and where they stand; nothing is promised but the shapes.

    ``names``       one an object, possibly repeated.
    ``meshes``      as read, each in its own space.
    ``mesh_of``     (n,) int64, places in ``meshes``.
    ``transforms``  (n, 4, 4) float64, from the mesh's space to the world (column vectors).
    ``see_through``  how many triangles of each mesh were left out for that.
    ``occluders``   (n,) bool, which are occluders already, that viewers do not see.
    """

    names: list[str]
    meshes: list[RawMesh]
    mesh_of: NDArray[np.int64]
    transforms: FloatArray
    see_through: list[int]
    occluders: NDArray[np.bool_]

    @classmethod
    def one(cls, name: str, mesh: RawMesh, see_through: int = 0) -> Objects:
        """A single object that stands where its mesh says."""
        return cls(
            [name], [mesh], np.zeros(1, dtype=np.int64), np.eye(4)[None], [see_through],
            np.zeros(1, dtype=np.bool_),
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Objects]) -> Objects:
        """All objects, in order."""
        starts = np.cumsum([0, *(len(part.meshes) for part in parts)])
        places = [part.mesh_of + start for part, start in zip(parts, starts[:-1], strict=True)]
        return cls(
            [name for part in parts for name in part.names],
            [mesh for part in parts for mesh in part.meshes],
            np.concatenate([np.empty(0, dtype=np.int64), *places]),
            np.concatenate([np.empty((0, 4, 4)), *(part.transforms for part in parts)]),
            [count for part in parts for count in part.see_through],
            np.concatenate([np.empty(0, dtype=np.bool_), *(part.occluders for part in parts)]),
        )


_NAMED = 5  # how many a warning lists


def unique_names(names: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """The names with ".2", ".3", ... put to what repeats, and one warning if anything did.

    What stands for no character (half of one in a file's JSON, a byte of another encoding in the
    name of a file) becomes "?": no report or table could be written with it.
    The first of a name keeps it, and no number makes a name that another object has from the start.
    """
    names = [encodable(name) for name in names]
    counts = Counter(names)
    if len(counts) == len(names):
        return tuple(names), []
    taken = set(counts)
    used: Counter[str] = Counter()
    result = []
    for name in names:
        used[name] += 1
        own = name
        if used[name] > 1:
            while own in taken:
                own = f"{name}.{used[name]}"
                used[name] += own in taken
            taken.add(own)
        result.append(own)
    repeated = [f"{count} are called '{name}'" for name, count in counts.items() if count > 1]
    return tuple(result), [
        f"names of objects repeat: {list_first(repeated)}; they were numbered"
        f" ('{_example(counts)}.2'), so give each its own name if you address objects by name"
    ]


def encodable(name: str) -> str:
    """The name with "?" for what UTF-8 cannot write."""
    return name if name.isascii() else name.encode("utf-8", "replace").decode("utf-8")


def _example(counts: Counter[str]) -> str:
    return next(name for name, count in counts.items() if count > 1)


def list_first(items: Sequence[str]) -> str:
    """The first few, and how many more there are."""
    more = len(items) - _NAMED
    return ", ".join(items[:_NAMED]) + (f" and {more} more" if more > 0 else "")
