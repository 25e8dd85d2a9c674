"""GDScript where there is no Godot: the plain part of it that our scripts at run time keep to,
turned line by line into Python, and a stand-in for the classes that they use.

What the language itself does otherwise (types, signals, the engine) only the engine shows.
"""

from __future__ import annotations

import gzip
import math
import re
import struct
from pathlib import Path
from types import SimpleNamespace

_DECLARED = re.compile(
    r"^(?:@export(?:_file\(.*?\))? )?(var|const) (\w+)(?:: [\w\[\]]+)?(?: ?:?= (.*))?$"
)
_FUNCTION = re.compile(r"^func (\w+)\((.*)\) -> [\w\[\]]+:$")
_LOCAL = re.compile(r"^(\t+)var (\w+)(?:: ?[\w\[\]]+ =| :=) ")
_OF_SELF = r"self.\1"
_LOOP = re.compile(r"^(\t+for \w+): \w+ in ")


def script(path, **names):
    """The class of a script; ``names`` is what it finds besides the stand-ins of this file."""
    lines = [line for line in path.read_text().splitlines() if not line.lstrip().startswith("#")]
    found = [_DECLARED.match(line) for line in lines]
    members = {match[2] for match in found if match}
    members |= {match[1] for line in lines if (match := _FUNCTION.match(line))}
    members |= {"set_process", "get_parent", "get_viewport"}
    own = re.compile(rf"(?<![\w.\"])({'|'.join(members)})\b(?!\")")
    made, fields = ["class Made(Base):"], ["\tdef __init__(self):"]
    for line, match in zip(lines, found, strict=True):
        if match:
            value = own.sub(_OF_SELF, _words(match[3] or "null"))
            fields.append(f"\t\tself.{match[2]} = {value}")
        elif line and not line.startswith("extends"):
            made.append("\t" + _line(line, own))
    place = {**_GLOBALS, **names}
    exec(compile("\n".join([*made, *fields, ""]), str(path), "exec"), place)
    return place["Made"]


def _line(line, own):
    if match := _FUNCTION.match(line):
        parameters = ", ".join(["self", *re.findall(r"(\w+): ", match[2])])
        return f"def {match[1]}({parameters}):"
    line = _LOCAL.sub(r"\1\2 = ", line)
    return own.sub(_OF_SELF, _words(_LOOP.sub(r"\1 in ", line)))


def _words(text):
    text = re.sub(r"  #.*", "", text).replace("= []", "= Packed()")
    text = "Packed()" if text == "[]" else text
    text = re.sub(r"% \[(.*)\]", r"% (\1,)", text)
    for word, meant in (("null", "None"), ("true", "True"), ("false", "False")):
        text = re.sub(rf"\b{word}\b", meant, text)
    text = re.sub(r"(\w+) is ([A-Z]\w+)", r"isinstance(\1, \2)", text)
    return re.sub(r"(\w+(?:\(\))?) as ([A-Z]\w+)", r"cast(\1, \2)", text)


class Text(str):
    """String."""

    def validate_node_name(self):
        return Text(re.sub(r"[.:@/\"%]", "_", self))

    def to_utf8_buffer(self):
        return PackedByteArray(self.encode())


class Packed(list):
    """An array of any kind; what is written past its end is an error, as in the engine."""

    def size(self):
        return len(self)

    def resize(self, count):
        self[:] = [*self[:count], *[0] * (count - len(self))]

    def fill(self, value):
        self[:] = [value] * len(self)

    def __getitem__(self, place):
        assert isinstance(place, slice) or 0 <= place < len(self)
        return super().__getitem__(place)


class PackedByteArray(bytearray):
    size, resize, fill = Packed.size, Packed.resize, Packed.fill

    def __getitem__(self, place):
        assert isinstance(place, slice) or 0 <= place < len(self)
        return super().__getitem__(place)

    def is_empty(self):
        return len(self) == 0

    def duplicate(self):
        return PackedByteArray(self)

    def slice(self, begin, end):
        assert 0 <= begin <= end <= len(self)
        return PackedByteArray(self[begin:end])

    def append_array(self, other):
        self.extend(other)

    def compress(self, kind):
        assert kind == "gzip"
        return PackedByteArray(gzip.compress(bytes(self)))

    def get_string_from_utf8(self):
        return Text(bytes(self).decode("utf-8", "replace"))

    def encode_u32(self, place, value):
        struct.pack_into("<I", self, place, value)

    def _decode(self, kind, place):
        assert 0 <= place <= len(self) - struct.calcsize(kind)
        return struct.unpack_from(kind, self, place)[0]

    def decode_u16(self, place):
        return self._decode("<H", place)

    def decode_u32(self, place):
        return self._decode("<I", place)

    def decode_u64(self, place):
        return self._decode("<q", place)  # the engine's whole numbers have a sign

    def decode_float(self, place):
        return self._decode("<f", place)

    def decode_double(self, place):
        return self._decode("<d", place)


class Vector3(SimpleNamespace):
    """x, y and z; float32 in most builds of the engine, here as they are given."""


class Place:
    """A Transform3D that only moves."""

    def __init__(self, by=(0.0, 0.0, 0.0)):
        self.by = by

    def affine_inverse(self):
        return Place([-value for value in self.by])

    def __mul__(self, point):
        x, y, z = self.by
        return Vector3(x=point.x + x, y=point.y + y, z=point.z + z)


class Node:
    def __init__(self, name="", *children):
        self.name, self._children, self.changes, self.valid = name, children, 0, True

    def get_children(self):
        return self._children


class Node3D(Node):
    """``changes`` counts how often it was shown or hidden."""

    def __init__(self, name="", *children, at=(0.0, 0.0, 0.0)):
        super().__init__(name, *children)
        self._visible, self.global_transform = True, Place(at)

    @property
    def visible(self):
        return self._visible

    @visible.setter
    def visible(self, value):
        self._visible, self.changes = value, self.changes + 1


class Base:
    """What scripts extend; ``log`` holds what they said."""

    @classmethod
    def new(cls):
        return cls()

    def set_process(self, on):
        self.processing = on

    def get_parent(self):
        return self.parent


def _cast(value, kind):
    return value if isinstance(value, kind) else None


def _read(path):
    return PackedByteArray(Path(path).read_bytes() if Path(path).is_file() else b"")


LOG: list[str] = []
"""What was told by push_error and push_warning."""

_GLOBALS = {
    "Base": Base, "Node": Node, "Node3D": Node3D, "PackedByteArray": PackedByteArray,
    "PackedStringArray": Packed, "PackedInt32Array": Packed, "Packed": Packed, "cast": _cast,
    "Vector3": Vector3,
    "FileAccess": SimpleNamespace(get_file_as_bytes=_read, COMPRESSION_GZIP="gzip"),
    "is_nan": math.isnan, "is_finite": math.isfinite, "minf": min, "maxf": max, "mini": min,
    "push_error": lambda text: LOG.append(f"ERROR: {text}"),
    "push_warning": lambda text: LOG.append(f"WARNING: {text}"),
    "is_instance_valid": lambda node: node.valid,
}  # fmt: skip
