"""Overrides of an asset, as its file beside it has them: ``castle.overrides.toml`` of castle.glb.

``docs/overrides.md`` says what users write.  Every fault is told with the line that it stands on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simplifier.checks import as_path, check_kind, is_number
from simplifier.errors import OverridesError
from simplifier.geometry.mesh import FloatArray, have_area
from simplifier.geometry.overrides import (
    NO_OVERRIDES,
    DrawnPart,
    Ignore,
    OpenRegion,
    Overrides,
    Pattern,
    Region,
)
from simplifier.io.suffixes import overrides_beside
from simplifier.io.toml import Table, read_toml

_LARGEST = 1e100  # of a coordinate
_MOST = 1000  # of a kind: regions are held against all parts and voxels, patterns against all names
_BOX = ("name", "center", "size", "rotation", "angle", "axis")


def overrides_of(mesh: Path) -> Overrides:
    """Those of the file beside a mesh, as :func:`load_overrides`; none decided without one."""
    beside = overrides_beside(mesh)
    return NO_OVERRIDES if beside is None else load_overrides(beside)


def load_overrides(path: str | Path, *, name: str | None = None) -> Overrides:
    """Read a file of overrides; messages call it ``name``, or by its path.

    Raises :class:`~simplifier.errors.OverridesError`, with the line, for what is no TOML, unknown
    keys, wrong values, quads that are none, and drawn parts that reach into open regions.
    """
    check_kind("name", name, str | None, "a text")
    top = read_toml(as_path("path", path), name=name, error=OverridesError)
    _check_keys(top, ("box", "quad", "open", "viewer", "ignore"), "at the top")
    boxes = [
        DrawnPart(_name(row, "box", index), _region(row, "[[box]]").triangles, row.where())
        for index, row in enumerate(_tables(top, "box"))
    ]
    quads = [
        DrawnPart(_name(row, "quad", index), _quad(row), row.where())
        for index, row in enumerate(_tables(top, "quad"))
    ]
    regions = [
        OpenRegion(_name(row, "open", index), _region(row, "[[open]]"), row.where())
        for index, row in enumerate(_tables(top, "open"))
    ]
    eyes = [_viewer(row) for row in _tables(top, "viewer")]
    viewers = np.array(eyes, dtype=np.float64).reshape(-1, 3)
    return Overrides((*boxes, *quads), tuple(regions), _ignore(top), viewers)


def _viewer(row: Table) -> FloatArray:
    _check_keys(row, ("name", "at"), "in [[viewer]]")
    return _numbers(row, "at", 3)


def _region(row: Table, title: str) -> Region:
    _check_keys(row, _BOX, f"in {title}")
    centre, size = _numbers(row, "center", 3), _numbers(row, "size", 3)
    if not (size > 0.0).all():
        raise _wrong(row, "size", "has an edge that is not above 0", "give three lengths above 0")
    region = Region.of(centre, size, _rotation(row))
    if not have_area(region.triangles).all():
        raise _wrong(
            row, "center", "is so far off that rounding flattens the size",
            "give a larger size, or a nearer center",
        )  # fmt: skip
    return region


def _rotation(row: Table) -> FloatArray:
    """(4,) a quaternion x y z w."""
    if "rotation" in row:
        if "angle" in row or "axis" in row:
            raise _wrong(row, "rotation", "stands beside an angle", "choose one of the two")
        found = _numbers(row, "rotation", 4)
        if not abs(np.linalg.norm(found) - 1.0) < 0.01:
            raise _wrong(row, "rotation", "is no unit quaternion", "give x y z w, of length 1")
        return found
    axis = row.get("axis", "y")
    if axis not in ("x", "y", "z"):
        raise _wrong(row, "axis", f"is {axis!r}", "choose x, y or z")
    degrees = row.get("angle", 0.0)
    if not is_number(degrees) or not math.isfinite(degrees):
        raise _wrong(row, "angle", f"is {degrees!r}", "give degrees")
    half = math.radians(degrees) / 2.0
    turned = np.zeros(4)
    turned["xyz".index(axis)], turned[3] = math.sin(half), math.cos(half)
    return turned


def _quad(row: Table) -> FloatArray:
    """(2, 3, 3): cut along the diagonal that lies inside."""
    _check_keys(row, ("name", "corners"), "in [[quad]]")
    corners = row.get("corners")
    if not isinstance(corners, list) or len(corners) != 4:
        raise _wrong(row, "corners", "are not four points", "give four of [x, y, z]")
    points = np.array([_point(row, point) for point in corners], dtype=np.float64)
    for first in (0, 1):
        turned = np.roll(points, -first, axis=0)
        halves = turned[[[0, 1, 2], [0, 2, 3]]]
        normals = np.cross(halves[:, 1] - halves[:, 0], halves[:, 2] - halves[:, 0])
        if have_area(halves).all() and normals[0] @ normals[1] > 0.0:
            return np.asarray(halves)
    raise _wrong(
        row, "corners", "make no quad: sides cross, or corners lie on one line",
        "give them in order around it",
    )  # fmt: skip


def _ignore(top: Table) -> Ignore:
    row = top.get("ignore")
    if row is None:
        return Ignore()
    if not isinstance(row, Table):
        raise _wrong(top, "ignore", "is not a table", "write [ignore]")
    _check_keys(row, ("meshes", "materials", "transparent"), "in [ignore]")
    transparent = row.get("transparent", "leave-out")
    if transparent not in ("leave-out", "keep"):
        raise _wrong(row, "transparent", f"is {transparent!r}", "choose leave-out or keep")
    return Ignore(_patterns(row, "meshes"), _patterns(row, "materials"), transparent != "keep")


def _patterns(row: Table, key: str) -> tuple[Pattern, ...]:
    texts = row.get(key, [])
    if not isinstance(texts, list) or not all(isinstance(text, str) and text for text in texts):
        raise _wrong(row, key, "is not a list of names", 'give such as ["glass*", "leaf?"]')
    if len(texts) > _MOST:
        raise _wrong(row, key, f"names {len(texts):,}", f"keep to {_MOST:,}, by patterns")
    return tuple(Pattern(text, row.where(key)) for text in texts)


def _tables(top: Table, key: str) -> list[Table]:
    found = top.get(key, [])
    if not isinstance(found, list) or not all(isinstance(row, Table) for row in found):
        raise _wrong(top, key, "is not a table of its own", f"write [[{key}]]")
    if len(found) > _MOST:
        raise OverridesError(
            f"there are {len(found):,} of [[{key}]]",
            where=top.where(key, _MOST),
            remedy=f"keep the {_MOST:,} that matter most",
        )
    return found


def _name(row: Table, kind: str, index: int) -> str:
    name = row.get("name", f"{kind} {index + 1}")
    if not isinstance(name, str) or not name:
        raise _wrong(row, "name", "is no text", "give one, or leave it out")
    return name


def _numbers(row: Table, key: str, count: int) -> FloatArray:
    found = row.get(key)
    if not isinstance(found, list) or len(found) != count or not all(map(_is_length, found)):
        what = "is missing" if found is None else f"is not {count} finite numbers"
        raise _wrong(row, key, what, f"give a list of {count}")
    return np.array(found, dtype=np.float64)


def _point(row: Table, value: Any) -> list[float]:
    if not isinstance(value, list) or len(value) != 3 or not all(map(_is_length, value)):
        raise _wrong(row, "corners", f"hold {value!r}", "give four of [x, y, z]")
    return value


def _is_length(value: object) -> bool:
    return is_number(value) and -_LARGEST < value < _LARGEST  # type: ignore[operator]


def _check_keys(table: Table, known: Sequence[str], place: str) -> None:
    for key in table:
        if key not in known:
            raise OverridesError(
                f"there is no key '{key}' {place}",
                where=table.where(key),
                remedy=f"choose from {', '.join(known)}",
            )


def _wrong(table: Table, key: str, what: str, remedy: str) -> OverridesError:
    return OverridesError(f"'{key}' {what}", where=table.where(key), remedy=remedy)
