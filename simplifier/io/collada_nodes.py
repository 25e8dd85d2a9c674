"""Where the nodes of a COLLADA scene stand: their transforms, composed in float64."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.xml_text import read_floats

_SIZES = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4, "lookat": 9}


def node_transform(node: Element, where: str) -> FloatArray:
    """(4, 4), from the node's space to that of its parent: its transforms, the first outermost.

    Raises :class:`UnreadableMeshError` for one that is not understood.
    """
    total = np.eye(4)
    for child in node:
        if child.tag == "skew":
            raise UnreadableMeshError(
                "a node is skewed, which is not understood",
                where=where,
                remedy="apply the transforms before the export",
            )
        if child.tag in _SIZES:
            total = composed(total, read_transform(child, child.tag, where))
    return total


def composed(outer: FloatArray, inner: FloatArray) -> FloatArray:
    """Both, the inner one first; not finite where they lead beyond all numbers."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(outer @ inner)


def read_transform(element: Element, kind: str, where: str) -> FloatArray:
    """(4, 4) of one transform; not finite where its numbers mean nothing."""
    numbers = read_floats(element, where)
    if len(numbers) != _SIZES[kind]:
        raise UnreadableMeshError(
            f"<{element.tag}> has {len(numbers)} numbers instead of {_SIZES[kind]}",
            where=where,
            remedy="copy or export it again",
        )
    result = np.eye(4)
    if kind == "matrix":
        return numbers.reshape(4, 4)
    if kind == "translate":
        result[:3, 3] = numbers
    elif kind == "scale":
        result[:3, :3] = np.diag(numbers)
    elif kind == "rotate":
        result[:3, :3] = _rotation(numbers[:3], np.radians(numbers[3]))
    else:
        result[:3] = _lookat(numbers[:3], numbers[3:6], numbers[6:])
    return result


def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Rodrigues' formula; none around an axis without a length."""
    if not axis.any():
        return np.eye(3)
    x, y, z = _unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    with np.errstate(invalid="ignore", over="ignore"):
        turned = np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return np.asarray(np.eye(3) + turned)


def _lookat(eye: FloatArray, interest: FloatArray, up: FloatArray) -> FloatArray:
    """(3, 4): right, up, backwards and the place of one who looks from ``eye``."""
    with np.errstate(invalid="ignore", over="ignore"):
        back = _unit(eye - interest)
        right = _unit(np.cross(up, back))
        return np.stack([right, np.cross(back, right), back, eye], axis=1)


def _unit(vector: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        return np.asarray(vector / np.linalg.norm(vector))
