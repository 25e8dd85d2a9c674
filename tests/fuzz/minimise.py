"""Make a failing input smaller while it fails in the same way.

Bytes by delta debugging (Zeller, Hildebrandt 2002: "Simplifying and isolating failure-inducing
input"): parts are left out, large ones first.  Cases by what they are made of: options, objects,
triangles and vertices are left out, and coordinates rounded and merged.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from tests.fuzz.cases import Case, Soup, read_case, soups_of, write_case

Item = TypeVar("Item")
Fails = Callable[[bytes], bool]

_FILLERS = (b"0", b" ", b"\0")


def minimised_bytes(data: bytes, fails: Fails) -> bytes:
    """No part of it can be left out, and no byte made a plain one."""
    data = bytes(without(list(data), lambda some: fails(bytes(some))))
    for place in range(len(data)):
        for filler in _FILLERS:
            tried = data[:place] + filler + data[place + 1 :]
            if data[place : place + 1] in _FILLERS:
                break
            if fails(tried):
                data = tried
                break
    return data


def without(items: list[Item], fails: Callable[[list[Item]], bool]) -> list[Item]:
    """The items that it takes, in order; ``fails`` of all of them holds."""
    size = max(len(items) // 2, 1)
    while items:
        begin = 0
        while begin < len(items):
            rest = items[:begin] + items[begin + size :]
            if rest and fails(rest):
                items = rest
            else:
                begin += size
        if size == 1:
            break
        size = max(size // 2, 1)
    return items


def minimised_case(data: bytes, fails: Fails) -> bytes:
    """Until no simpler case of :func:`_simpler` fails."""
    progress = True
    while progress:
        progress = False
        for simpler in _simpler(read_case(data)):
            tried = write_case(simpler)
            if len(tried) < len(data) and fails(tried):
                data, progress = tried, True
                break
    return data


def _copy(case: Case) -> Case:
    copied = json.loads(json.dumps(case))
    assert isinstance(copied, dict)
    return copied


def _simpler(case: Case) -> Iterator[Case]:
    """Cases with less in them, the boldest steps first."""
    for index in range(len(soups_of(case))):
        for change in _less(soups_of(case)[index]):
            copied = _copy(case)
            soups_of(copied)[index].update(change)
            yield copied
    for name in case["options"]:
        copied = _copy(case)
        del copied["options"][name]
        yield copied
    for index in range(len(case.get("mesh_of", ())) if len(case.get("mesh_of", ())) > 1 else 0):
        copied = _copy(case)
        del copied["mesh_of"][index], copied["transforms"][index]
        yield copied
    for index in range(len(case.get("cameras", ()))):
        copied = _copy(case)
        del copied["cameras"][index]
        yield copied


def _less(soup: Soup) -> Iterator[Soup]:
    """What replaces a mesh: fewer triangles, then no stray vertices, then plainer coordinates."""
    faces, vertices = soup["faces"], soup["vertices"]
    size = len(faces) // 2
    while size:
        for begin in range(0, len(faces), size):
            yield {"faces": faces[:begin] + faces[begin + size :]}
        size //= 2
    used = sorted({corner for face in faces for corner in face})
    if len(used) < len(vertices):
        place = {corner: index for index, corner in enumerate(used)}
        yield {
            "vertices": [vertices[corner] for corner in used],
            "faces": [[place[corner] for corner in face] for face in faces],
        }
    yield from ({"vertices": plainer} for plainer in _plainer(vertices))


def _plainer(vertices: Sequence[Sequence[float]]) -> Iterator[list[list[float]]]:
    """All coordinates with fewer digits; then one vertex at a time, or put onto another."""
    for digits in (1, 2, 4, 8):
        yield [[_rounded(value, digits) for value in point] for point in vertices]
    for index, point in enumerate(vertices):
        for plain in ([_rounded(value, 1) for value in point], vertices[0]):
            if list(plain) != list(point):
                yield [*map(list, vertices[:index]), list(plain), *map(list, vertices[index + 1 :])]


def _rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}") if math.isfinite(value) else value
