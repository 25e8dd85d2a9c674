"""Arrays of any kind that callers may give, as those that meshes are made of."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.checks import is_number, value_text
from simplifier.errors import MeshError, OptionError

_MOST = int(np.iinfo(np.int32).max)  # faces are stored as int32


def vertex_array(vertices: ArrayLike, where: str) -> NDArray[np.float64]:
    """(n, 3) float64 of real numbers, which may be NaN or infinite; a copy only where it must.

    Raises :class:`MeshError` for another shape, other than real numbers, and masked values.
    """
    values = _real_numbers("vertices", vertices, where)
    if values.size == 0:
        return np.empty((0, 3))
    if values.ndim != 2 or values.shape[1] != 3:
        raise MeshError(
            f"vertices have shape {values.shape}", where=where, remedy="pass an (n, 3) array"
        )
    if len(values) > _MOST:
        raise MeshError(
            f"there are {len(values)} vertices, more than {_MOST}",
            where=where,
            remedy="split the mesh",
        )
    try:
        with np.errstate(over="ignore"):  # a wider float becomes infinite, as a literal would
            return np.asarray(values, dtype=np.float64)
    except OverflowError:  # a whole number of Python's, which does not
        raise _array_error("a coordinate of the vertices is beyond all floats", where) from None


def face_array(faces: ArrayLike, count: int, where: str) -> NDArray[np.int64]:
    """(m, 3) int64 from 0 to ``count`` - 1; a copy only where it must.

    Whole floats will do.  Raises :class:`MeshError` as :func:`vertex_array` does, and for a value
    that is no index of a vertex.
    """
    values = _real_numbers("faces", faces, where)
    if values.size == 0:
        return np.empty((0, 3), dtype=np.int64)
    if values.ndim != 2 or values.shape[1] != 3:
        raise MeshError(
            f"faces have shape {values.shape}",
            where=where,
            remedy="pass an (m, 3) array of vertex indices",
        )
    # In the type that was given: int64 would turn 2**64 - 1 into -1, and 0.5 into 0.
    wrong = ~((values >= 0) & (values < count))  # NaN is wrong too
    if values.dtype.kind not in "iu":
        wrong |= np.where(wrong, 0, values) % 1 != 0
    if wrong.any():
        face = int(np.nonzero(wrong.any(axis=1))[0][0])
        raise MeshError(
            f"face {face} names vertex {values[face][wrong[face]][0]}, but there are {count}"
            " vertices",
            where=where,
            remedy="repair the face indices, whole numbers from 0",
        )
    return np.asarray(values, dtype=np.int64)


def cross_products(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) of two (n, 3), to the bit those of ``np.cross``, which takes three times as long for
    the few triangles of an occluder."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    made = np.empty(a.shape)
    np.subtract(ay * bz, az * by, out=made[:, 0])
    np.subtract(az * bx, ax * bz, out=made[:, 1])
    np.subtract(ax * by, ay * bx, out=made[:, 2])
    return made


def vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """(3,) float64, finite.  Raises :class:`OptionError`."""
    try:
        numbers = _real_numbers(name, value, "").astype(np.float64).ravel()
    except (MeshError, OverflowError):
        numbers = np.empty(0)
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise OptionError(
            f"{value_text(value)} is not a vector", where=name, remedy="pass three finite numbers"
        )
    return numbers


def check_arrays(vertices: object, faces: object, remedy: str) -> None:
    """Refuse what are not (n, 3) float64 and (m, 3) int32, and make both read-only.

    Raises :class:`MeshError` with the ``remedy``.
    """
    for name, array, kind in (("vertices", vertices, "float64"), ("faces", faces, "int32")):
        if not isinstance(array, np.ndarray) or array.dtype != kind or array.shape[1:] != (3,):
            raise MeshError(f"{_kind(array)} cannot be the {name}, (n, 3) {kind}", remedy=remedy)
        array.setflags(write=False)


def _kind(array: object) -> str:
    if isinstance(array, np.ndarray):
        return f"an array of shape {array.shape} and type {array.dtype}"
    return value_text(array)


def _real_numbers(name: str, given: ArrayLike, where: str) -> NDArray[Any]:
    """At least two axes, in the type that was given; Python's own numbers of any size pass."""
    try:
        values = np.atleast_2d(np.asarray(given))
    except (TypeError, ValueError) as error:  # rows of different lengths, too many axes
        raise _array_error(f"{name} are no array ({error})", where) from None
    kind = values.dtype.kind
    if kind not in "iuf" and not (kind == "O" and all(map(is_number, values.ravel()))):
        raise _array_error(f"{name} are of type {values.dtype}", where)
    # None is masked where nobody has loaded such arrays, which takes longer than to check a mesh.
    masked = sys.modules.get("numpy.ma")
    if masked is not None and masked.is_masked(given):
        raise _array_error(f"{name} have masked values", where)
    return values


def _array_error(what: str, where: str) -> MeshError:
    return MeshError(what, where=where, remedy="pass an array of real numbers")


def rounded_up(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """The least float32 that is no less than each of ``values``, which may be infinite then."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = values.astype(np.float32)
    return np.nextafter(rounded, np.float32(np.inf), where=rounded < values, out=rounded)
