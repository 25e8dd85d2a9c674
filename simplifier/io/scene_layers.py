"""A scene as it is drawn, and beside it what of it may hide anything."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.errors import EmptyMeshError
from simplifier.geometry.scene import Scene
from simplifier.io.scene import load_scene
from simplifier.options.simplify import Transparent
from simplifier.wording import count


def load_layers(
    path: str | Path,
    *,
    transparent: Transparent = "leave-out",
    memory_limit: float | None = None,
    allow_external: bool = True,
) -> tuple[Scene, Scene]:
    """All objects of a scene, and what of them one cannot see through, by the same names.

    ``transparent``  ``leave-out``: what one can see through is in the first scene alone; an object
                     of which nothing else is left is not in the second, which may be empty.
                     ``keep``: both are the same.
    ``memory_limit`` GiB, and ``allow_external``, as of ``load_scene``.

    Raises what :func:`~simplifier.io.scene.load_scene` does.  A scene without anything to see
    through is read once.
    """
    try:
        opaque = load_scene(
            path,
            transparent=transparent,
            memory_limit=memory_limit,
            allow_external=allow_external,
        )
    except EmptyMeshError:
        if transparent == "keep":
            raise
        opaque = Scene((), (), np.zeros(0, dtype=np.int32), np.zeros((0, 4, 4)), see_through=1)
    whole = whole_scene(path, opaque, memory_limit, allow_external)
    if whole is opaque:
        return opaque, opaque
    return replace(whole, warnings=(*whole.warnings, *_told(whole, opaque))), opaque


def whole_scene(
    path: str | Path,
    opaque: Scene,
    memory_limit: float | None = None,
    allow_external: bool = True,
) -> Scene:
    """All objects of the scene that ``opaque`` was read from: that itself where it has all."""
    if not opaque.see_through:
        return opaque
    return load_scene(
        path, transparent="keep", memory_limit=memory_limit, allow_external=allow_external
    )


def _told(whole: Scene, opaque: Scene) -> list[str]:
    """What the user should know of the objects that hide less than they show."""
    solid = dict(zip(opaque.names, opaque.triangle_counts.tolist(), strict=True))
    counts = zip(whole.names, whole.triangle_counts.tolist(), strict=True)
    left = [(triangles, solid.get(name, 0)) for name, triangles in counts]
    glass = sum(hiding == 0 for _, hiding in left)
    partly = sum(0 < hiding < triangles for triangles, hiding in left)
    some = [f"all of {count(glass, 'object')}"] * bool(glass)
    some += [f"parts of {count(partly, 'object')}"] * bool(partly)
    if not some:
        return []
    return [f"what one can see through may be seen, and hides nothing: {' and '.join(some)}"]
