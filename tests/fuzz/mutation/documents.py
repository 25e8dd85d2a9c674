"""Changes of JSON that stay JSON, so that they come past the parser."""

from __future__ import annotations

import json
import struct
from random import Random
from typing import Any

_VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 3, 5, 0.5, 1.0, -0.0, 1e-320, 1e-45, 1e39, 1e150, 1e308, 2**31,
    2**32, 2**53, 2**63, 2**64, 10**400, float("nan"), float("inf"), float("-inf"), "", "x", "0",
    "nan", "\0", "\ud800", "../../x", "data:,", "data:application/octet-stream;base64,AAAA", [], {},
    [0], [[]], [None], [0, 0], [1, 2, 3], {"": 0}, 5120, 5121, 5123, 5125, 5126, "VEC3", "VEC4",
    "SCALAR", "2.0", "KHR_draco_mesh_compression", [0.0, 0.0, 0.0, 1.0], [1, 1, 1], [0] * 16,
)  # fmt: skip
_DEEP = 900  # levels; beyond, writing it recurses too far


def edit(random: Random, data: bytes, other: bytes) -> bytes:
    """One change of a JSON document, of its own or by a branch of another; others pass."""
    document, own = _parsed(data), _parsed(other)
    if document is None:
        return data
    changed = _changed(random, document, own)
    return json.dumps(changed).encode("utf-8", "surrogatepass")


def edit_glb(random: Random, data: bytes, other: bytes) -> bytes:
    """The same within a GLB, with lengths made right again; others pass."""
    parts, from_other = _chunks(data), _chunks(other)
    if parts is None:
        return data
    text = edit(random, parts[0], from_other[0] if from_other else b"")
    return _glb(text, parts[1])


def _parsed(data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return None


def _places(document: Any) -> list[tuple[Any, Any]]:
    """(container, key) of every value."""
    found: list[tuple[Any, Any]] = []
    waiting = [document]
    while waiting:
        one = waiting.pop()
        if isinstance(one, dict | list):
            keys = list(one) if isinstance(one, dict) else range(len(one))
            found += [(one, key) for key in keys]
            waiting += [one[key] for key in keys]
    return found


def _changed(random: Random, document: Any, other: Any) -> Any:
    """Changes in place."""
    places = _places(document)
    if not places:
        return random.choice(_VALUES)
    where, key = random.choice(places)
    own = _places(other)
    match random.randrange(8):
        case 0 | 1:
            where[key] = random.choice(_VALUES)
        case 2:
            where[key] = _nudged(random, where[key])
        case 3:
            del where[key]
        case 4:
            there, name = random.choice(places)
            where[key] = json.loads(json.dumps(there[name]))
        case 5 if isinstance(where, list):
            where.insert(key, json.loads(json.dumps(where[key])))
        case 6 if own:
            there, name = random.choice(own)
            where[key] = there[name]
        case 7 if random.random() < 0.02:
            where[key] = json.loads("[" * _DEEP + "]" * _DEEP)
        case _:
            there, name = random.choice(places)
            if isinstance(where, dict):
                where[name if isinstance(name, str) else "x"] = where[key]
    return document


def _nudged(random: Random, value: Any) -> Any:
    """A little off, a sign turned, or a list longer or shorter."""
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, int):
        return value + random.choice((-2, -1, 1, 2))
    if isinstance(value, float):
        return value * random.choice((-1.0, 0.0, 1e-30, 1e30, 1e300, 1.0000001))
    if isinstance(value, str):
        return value[:-1] if random.random() < 0.5 else value * 2
    if isinstance(value, list):
        return value[:-1] if random.random() < 0.5 else [*value, *value[:1]]
    return {}


def _chunks(data: bytes) -> tuple[bytes, bytes] | None:
    """The JSON and what stands behind it."""
    if data[:4] != b"glTF" or len(data) < 20:
        return None
    length = int.from_bytes(data[12:16], "little")
    return data[20 : 20 + length], data[20 + length :]


def _glb(text: bytes, rest: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON")
    return head + text + rest
