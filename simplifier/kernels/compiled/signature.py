"""What a kernel takes, as text: ``"float64[:, :], (uint8[:, :, :], int64), bool"``.

Names are those of numpy.  An array is C-contiguous and aligned, with as many axes as it has colons,
and may be read-only where the kernel does not write it; parentheses hold a tuple.  Machine code
looks at nothing of that by itself, so arguments are held against it at each call.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

_CONTIGUOUS_AND_ALIGNED = 0x101  # of numpy's flags, read all at once: this is done at every call
_NUMBERS = {
    "bool": (bool, np.bool_),
    "int64": (int, np.integer, np.bool_),
    "uint64": (int, np.integer, np.bool_),
    "float64": (float, int, np.floating, np.integer),
}


class _Part:
    """What an argument, or a part of one, is to be."""

    @cached_property
    def fits(self) -> Callable[[object], bool]:
        """Whether something is that.  One expression of Python for all of a kernel's arguments: to
        go from part to part took as long as the smaller kernels."""
        known: dict[str, object] = {"ndarray": np.ndarray}
        source = self.source("given", known)
        found: Callable[[object], bool] = eval(f"lambda given: {source}", known)
        return found

    def source(self, given: str, known: dict[str, object]) -> str:
        """That as an expression, ``given`` being one too; what it names is added to ``known``."""
        raise NotImplementedError


@dataclass(frozen=True)
class Number(_Part):
    """A scalar of that name."""

    name: str

    @property
    def dtype(self) -> np.dtype[np.generic]:
        return np.dtype(self.name)

    def source(self, given: str, known: dict[str, object]) -> str:
        known[f"{self.name}_classes"] = _NUMBERS[self.name]
        return f"isinstance({given}, {self.name}_classes)"

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Table(_Part):
    """An array of that dtype and as many axes."""

    name: str
    axes: int

    @cached_property
    def dtype(self) -> np.dtype[np.generic]:
        return np.dtype(self.name)

    def source(self, given: str, known: dict[str, object]) -> str:
        known[f"{self.name}_dtype"] = self.dtype
        flags = _CONTIGUOUS_AND_ALIGNED
        return (
            f"isinstance({given}, ndarray) and {given}.ndim == {self.axes}"
            f" and {given}.dtype == {self.name}_dtype and {given}.flags.num & {flags} == {flags}"
        )

    def __str__(self) -> str:
        return f"{self.name}[{', '.join(':' * self.axes)}]"


@dataclass(frozen=True)
class Group(_Part):
    """A tuple of such parts."""

    parts: tuple[Number | Table | Group, ...]

    def source(self, given: str, known: dict[str, object]) -> str:
        parts = [part.source(f"{given}[{i}]", known) for i, part in enumerate(self.parts)]
        whole = f"isinstance({given}, tuple) and len({given}) == {len(parts)}"
        return " and ".join([whole, *parts])

    def __str__(self) -> str:
        return f"({', '.join(map(str, self.parts))})"


Part = Number | Table | Group


def parse_signature(text: str) -> Group:
    """The arguments that a text names; raises ValueError for what is no such text."""
    try:
        tree = ast.parse(f"({text},)", mode="eval").body
        found = _part(tree)
    except (SyntaxError, KeyError, TypeError) as error:
        raise ValueError(f"{text!r} names no arguments") from error
    assert isinstance(found, Group)
    return found


def _part(tree: ast.expr) -> Part:
    match tree:
        case ast.Tuple(parts):
            return Group(tuple(map(_part, parts)))
        case ast.Name(name):
            _NUMBERS[name]  # or KeyError
            return Number(name)
        case ast.Subscript(ast.Name(name), slices):
            axes = slices.elts if isinstance(slices, ast.Tuple) else [slices]
            if not all(isinstance(axis, ast.Slice) for axis in axes):
                raise KeyError(name)
            np.dtype(name)  # or TypeError
            return Table(name, len(axes))
    raise KeyError(ast.dump(tree))


def misfit(signature: Group, arguments: tuple[object, ...]) -> str:
    """What does not fit, in words, for a call that was refused."""
    if len(arguments) != len(signature.parts):
        return f"{len(arguments)} arguments, where it takes {len(signature.parts)}"
    for place, (part, given) in enumerate(zip(signature.parts, arguments, strict=True)):
        if not part.fits(given):
            return f"argument {place} is {_told(given)}, where it takes {part}"
    raise AssertionError("all of them fit")


def _told(given: object) -> str:
    if isinstance(given, tuple):
        return f"({', '.join(map(_told, given))})"
    if isinstance(given, np.ndarray):
        order = "" if given.flags.c_contiguous and given.flags.aligned else ", not C-contiguous"
        return f"{given.dtype}[{', '.join(':' * given.ndim)}]{order}"
    return type(given).__name__
