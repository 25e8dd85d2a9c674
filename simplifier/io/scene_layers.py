"""A scene as it is drawn, and beside it what of it may hide anything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simplifier.errors import EmptyMeshError, printable
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.overrides import Region
from simplifier.geometry.scene import Scene
from simplifier.io.overrides import load_overrides
from simplifier.io.scene import files_of, load_scene, unused_overrides
from simplifier.io.suffixes import overrides_beside
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

    An object that reaches into a region which overrides beside a file leave open is not in the
    second scene either.  Raises what :func:`~simplifier.io.scene.load_scene` does, and
    :class:`~simplifier.errors.OverridesError`.  A scene without anything to see through is read
    once.
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
    if whole is not opaque:
        whole = replace(whole, warnings=(*whole.warnings, *_told(whole, opaque)))
    regions = _regions(path)
    if not regions:
        return whole, opaque
    hiding = _without_opened(opaque, regions)
    passed_over = set(map(printable, unused_overrides(files_of(Path(path)))))
    warnings = [one for one in whole.warnings if one not in passed_over]
    return replace(whole, warnings=(*warnings, _told_open(opaque, hiding))), hiding


def hiding_of(path: str | Path, opaque: Scene) -> Scene:
    """What hides anything of the scene that ``opaque`` was read from: the second of its layers."""
    regions = _regions(path)
    return _without_opened(opaque, regions) if regions else opaque


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


def _regions(path: str | Path) -> list[Region]:
    """Where players look through, by all overrides beside a scene's files; world units."""
    found = filter(None, map(overrides_beside, files_of(Path(path))))
    return [one.region for beside in found for one in load_overrides(beside).open]


def _without_opened(scene: Scene, regions: Sequence[Region]) -> Scene:
    """The scene without the objects of which a triangle reaches into a region."""

    def is_opened(index: int, box: FloatArray) -> bool:
        near = [one for one in regions if one.meets_box(box)]
        if not near:
            return False
        mesh = scene.joined([index])
        corners = mesh.vertices[mesh.faces]
        return any(one.crossed_by(corners).any() for one in near)

    opened = np.array([is_opened(*one) for one in enumerate(scene.bounds())], dtype=np.bool_)
    return scene.some(~opened) if opened.any() else scene


def _told_open(opaque: Scene, hiding: Scene) -> str:
    opened = count(len(opaque) - len(hiding), "object")
    return f"overrides leave regions open: {opened} that would close them may be seen through"


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
