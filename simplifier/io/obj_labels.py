"""The names that a Wavefront OBJ file gives its faces: ``o``, ``g`` and ``usemtl``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.io.polygons import IndexArray
from simplifier.io.text import named_lines
from simplifier.kernels.text import count_obj_corners


@dataclass(frozen=True)
class Named:
    """What is in force from a byte of the file on: object, groups, and material."""

    objects: tuple[str, ...]
    material: str


def named_runs(data: bytes) -> tuple[list[Named], IndexArray, list[str]]:
    """The names in force, run by run; the faces (polygons) of each run; what ``mtllib`` says.

    Empty objects and materials stand for none; the first run begins with the file.
    """
    libraries: list[str] = []
    runs, begins = [Named((), "")], [0]
    title, groups, material = "", tuple[str, ...](), ""
    for begin, keyword, rest in named_lines(data, (b"o", b"g", b"usemtl", b"mtllib")):
        match keyword:
            case b"mtllib":
                libraries.append(rest)
                continue
            case b"o":
                title = rest
            case b"g":
                groups = tuple(rest.split())
            case _:
                material = rest
        objects = tuple(dict.fromkeys(name for name in (title, *groups) if name))
        runs.append(Named(objects, material))
        begins.append(begin)
    text = np.frombuffer(data, dtype=np.uint8)
    ends = [*begins[1:], len(data)]
    faces = [count_obj_corners(text[begin:end])[0] for begin, end in zip(begins, ends, strict=True)]
    return runs, np.array(faces, dtype=np.int64), libraries
