"""Triangles with the names that a file has for them, and which of them are taken."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simplifier.errors import EmptyMeshError, OverridesError
from simplifier.geometry.mesh import FloatArray, IndexArray, Omitted
from simplifier.geometry.overrides import Ignore, Pattern
from simplifier.io.objects import list_first

KEEP = 'keep them with --transparent keep (transparent="keep" in Python)'
"""What to do where too much was left out for being see-through."""


@dataclass(frozen=True)
class Label:
    """What a file says of some of its triangles.

    ``objects``      names of what they belong to, the first for messages; empty ones count not.
    ``material``     its name, empty without one.
    ``see_through``  whether what is behind can be seen through it.
    ``occluder``     whether it is an occluder already, which viewers do not see.
    """

    objects: tuple[str, ...] = ()
    material: str = ""
    see_through: bool = False
    occluder: bool = False


@dataclass(frozen=True, eq=False)
class Labelled:
    """``vertices`` (n, 3) and ``faces`` (m, 3) of a file, in runs: the first ``counts[0]`` faces
    have the first of ``labels``, and so on; the counts add up to m.
    """

    vertices: FloatArray
    faces: IndexArray
    labels: Sequence[Label]
    counts: Sequence[int]


def sieve(
    found: Labelled, ignore: Ignore, where: str
) -> tuple[FloatArray, IndexArray, tuple[Omitted, ...]]:
    """The vertices, the faces that are taken, and what is left out, in the order of the file.

    A material's or an object's pattern comes before what is see-through.  Raises
    :class:`~simplifier.errors.OverridesError` for a pattern that matches no name of the file, and
    :class:`~simplifier.errors.EmptyMeshError` where nothing is taken of a file with triangles.
    """
    _check_used(ignore.meshes, "mesh", (name for label in found.labels for name in label.objects))
    _check_used(ignore.materials, "material", (label.material for label in found.labels))
    reasons = {label: _reason(label, ignore) for label in set(found.labels)}
    omitted: dict[tuple[str, bool], int] = {}
    for label, count in zip(found.labels, found.counts, strict=True):
        reason = reasons[label]
        if reason is not None and count:
            omitted[reason] = omitted.get(reason, 0) + count
    left_out = tuple(Omitted(*reason, count) for reason, count in omitted.items())
    if not left_out:
        return found.vertices, found.faces, ()
    taken = [reasons[label] is None for label in found.labels]
    faces = found.faces[np.repeat(np.array(taken), found.counts)]
    if len(faces) == 0:
        raise EmptyMeshError(
            f"nothing opaque is left: {omitted_words(left_out)}",
            where=where,
            remedy=KEEP if any(one.see_through for one in left_out) else "ignore less of it",
        )
    return found.vertices, faces, left_out


def opaque_faces(found: Labelled) -> IndexArray:
    """The faces that one cannot see through, which may be none."""
    opaque = [not label.see_through for label in found.labels]
    return found.faces if all(opaque) else found.faces[np.repeat(np.array(opaque), found.counts)]


def _reason(label: Label, ignore: Ignore) -> tuple[str, bool] | None:
    """The name that a part is left out by and whether for being see-through; None where taken."""
    if any(pattern.matches([label.material]) for pattern in ignore.materials):
        return f"material '{label.material}'", False
    for pattern in ignore.meshes:
        for name in label.objects:
            if pattern.matches([name]):
                return f"mesh '{name}'", False
    if label.occluder:
        return f"occluder '{label.objects[0]}'", False
    if not (label.see_through and ignore.see_through):
        return None
    return f"material '{label.material}'", True


def _check_used(patterns: Sequence[Pattern], kind: str, names: Iterable[str]) -> None:
    if not patterns:
        return
    there = list(dict.fromkeys(name for name in names if name))
    for pattern in patterns:
        if not pattern.matches(there):
            known = list_first([f"'{name}'" for name in there])
            raise OverridesError(
                f"no {kind} is called '{pattern.text}'",
                where=pattern.where,
                remedy=f"the file has {known}" if there else f"the file names no {kind}",
            )


def omitted_words(omitted: Sequence[Omitted]) -> str:
    """``12 see-through triangles of material 'glass' were left out``, and what was ignored."""
    groups: Mapping[bool, list[Omitted]] = {
        see_through: [one for one in omitted if one.see_through is see_through]
        for see_through in (True, False)
    }
    words = []
    for see_through, group in groups.items():
        if group:
            kind = "see-through" if see_through else "ignored"
            count = sum(one.triangles for one in group)
            noun = "triangle was" if count == 1 else "triangles were"
            names = list_first([one.name for one in group])
            words.append(f"{count} {kind} {noun} left out ({names})")
    return ", ".join(words)
