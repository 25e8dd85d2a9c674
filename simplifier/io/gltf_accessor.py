"""Accessors of a glTF file as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.io.float32 import to_float64
from simplifier.io.gltf_buffers import Buffers
from simplifier.io.gltf_json import JsonObject

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
# An accessor without data is all zeros and could claim any size, and a file have many of them.
_MOST_ZEROS = 1_000_000


def read_accessor(buffers: Buffers, index: int, kind: str) -> NDArray[Any]:
    """(count, width) in the stored dtype, sparse values put in.  May be a view into the file.

    ``kind`` is SCALAR, VEC3 or VEC4.  Raises ``UnreadableMeshError`` for another kind and for what
    lies out of bounds.
    """
    accessor = buffers.document.root.item("accessors", index)
    if accessor.members.get("type") != kind:
        raise accessor.fail(f"is not of type {kind}", "the file is damaged; export it again")
    dtype = _dtype(accessor)
    count, width = accessor.integer("count"), _WIDTHS[kind]
    if accessor.has("bufferView"):
        place = accessor.integer("bufferView"), accessor.integer("byteOffset", 0)
        values = _read(buffers, accessor, *place, dtype, count, width)
    else:
        buffers.zeros += count
        if buffers.zeros > _MOST_ZEROS:
            raise accessor.fail(
                f"claims {count} elements without any data, {buffers.zeros} with those before",
                "export it again",
            )
        values = np.zeros((count, width), dtype=dtype)
    if accessor.has("sparse"):
        values = _with_sparse(buffers, accessor, values)
    return values


def read_vectors(buffers: Buffers, index: int, kind: str) -> FloatArray:
    """(count, width) float64; normalized integers are scaled to [0, 1] or [-1, 1]."""
    values = read_accessor(buffers, index, kind)
    result = to_float64(values)
    accessor = buffers.document.root.item("accessors", index)
    if accessor.members.get("normalized") is True and values.dtype.kind in "iu":
        result = np.maximum(result / np.iinfo(values.dtype).max, -1.0)
    return result


def _dtype(owner: JsonObject) -> np.dtype[Any]:
    code = owner.integer("componentType")
    if code not in _TYPES:
        raise owner.fail(f"componentType {code} is unknown", "the file is damaged")
    return np.dtype(_TYPES[code])


def _read(
    buffers: Buffers,
    owner: JsonObject,
    view: int,
    offset: int,
    dtype: np.dtype[Any],
    count: int,
    width: int,
) -> NDArray[Any]:
    data, begin, end, stride = buffers.view(view)
    size = dtype.itemsize * width
    stride = stride or size
    start = begin + offset
    if count and start + stride * (count - 1) + size > end:
        raise owner.fail(
            f"{count} elements reach beyond their buffer view", "the file is damaged or truncated"
        )
    if not count:
        return np.zeros((0, width), dtype=dtype)
    strides = (stride, dtype.itemsize)
    return np.ndarray((count, width), dtype, data, offset=start, strides=strides)


def _with_sparse(buffers: Buffers, accessor: JsonObject, base: NDArray[Any]) -> NDArray[Any]:
    sparse = accessor.child("sparse")
    places, news = sparse.child("indices"), sparse.child("values")
    count = sparse.integer("count")
    indices, values = (
        _read(
            buffers,
            part,
            part.integer("bufferView"),
            part.integer("byteOffset", 0),
            dtype,
            count,
            width,
        )
        for part, dtype, width in (
            (places, _dtype(places), 1),
            (news, base.dtype, base.shape[1]),
        )
    )
    if indices.dtype.kind != "u" or (count and int(indices.max()) >= len(base)):
        raise sparse.fail("replaces elements that are not there", "the file is damaged")
    result = base.copy()
    result[indices[:, 0]] = values
    return result
