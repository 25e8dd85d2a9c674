"""Patterns of paths, and the mesh files that they name.

``*`` and ``?`` stand for characters of one name, ``[...]`` for one of some, ``**`` for any number
of folders.  Folders and files that begin with a dot are not looked at, and links to folders are not
followed, so that no walk goes round in circles.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from simplifier.errors import ManifestError
from simplifier.io.suffixes import MESH_SUFFIXES

_PIECE = re.compile(r"\*+|\?|\[!?\]?[^\]]*\]|.", re.DOTALL)
_MAGIC = re.compile(r"[*?\[]")


@dataclass(frozen=True)
class Glob:
    """A pattern of paths below a folder, with ``/`` between names.

    ``where``  the file and line that it stands at.  Raises :class:`ManifestError` for a pattern
    that leads out of the folder or is none.
    """

    text: str
    where: str

    def __post_init__(self) -> None:
        names = self.text.split("/")
        if "\\" in self.text or not all(names) or ".." in names or ":" in names[0]:
            raise ManifestError(
                f"'{self.text}' is not a path below the manifest's folder",
                where=self.where,
                remedy="name files as in 'props/**/*.glb'",
            )
        try:
            _ = self._regex
        except re.error as error:
            raise ManifestError(
                f"'{self.text}' is not a pattern ({error})", where=self.where, remedy="correct it"
            ) from None

    @property
    def literal(self) -> bool:
        """Whether it names one path."""
        return _MAGIC.search(self.text) is None

    @property
    def base(self) -> str:
        """The folder that all it names are below, empty for the manifest's own."""
        names = self.text.split("/")[:-1]
        fixed = next((i for i, name in enumerate(names) if _MAGIC.search(name)), len(names))
        return "/".join(names[:fixed])

    def matches(self, path: str) -> bool:
        """Whether it names a path, which has ``/`` between names."""
        return self._regex.fullmatch(path) is not None

    @cached_property
    def _regex(self) -> re.Pattern[str]:
        *folders, last = self.text.split("/")
        if last == "**":
            folders, last = [*folders, "**"], "*"
        above = "".join("(?:[^/]+/)*" if one == "**" else f"{_name(one)}/" for one in folders)
        return re.compile(above + _name(last), re.DOTALL)


def _name(text: str) -> str:
    """What one name has to be like, as a regular expression."""
    return "".join(map(_piece, _PIECE.findall(text)))


def _piece(text: str) -> str:
    if text[0] == "*":
        return "[^/]*"
    if text == "?":
        return "[^/]"
    if text[0] == "[" and len(text) > 1:
        negated = text[1] == "!"
        inside = text[2 if negated else 1 : -1].replace("\\", r"\\").replace("[", r"\[")
        return f"(?!/)[{'^' if negated else ''}{_safe(inside)}]"
    return re.escape(text)


def _safe(inside: str) -> str:
    """Of a set: what would begin or negate another one stands for itself."""
    inside = inside.replace("]", r"\]")
    if inside.startswith("^"):
        inside = "\\" + inside
    return re.sub(r"([&~|])", r"\\\1", inside)


def mesh_files(folder: Path, patterns: Iterable[Glob]) -> list[str]:
    """The mesh files that patterns may name, by path: whatever is below their bases."""
    bases: list[str] = []
    for base in sorted({pattern.base for pattern in patterns}):
        if not any(above in ("", base) or base.startswith(f"{above}/") for above in bases):
            bases.append(base)
    return sorted(path for base in bases for path in _below(folder, base))


def _below(folder: Path, base: str) -> Iterator[str]:
    if any(name.startswith(".") for name in base.split("/")):
        return
    root = os.fspath(folder)
    for place, folders, names in os.walk(os.path.join(root, base)):  # noqa: PTH118
        folders[:] = [name for name in folders if not name.startswith(".")]
        above = os.path.relpath(place, root).replace(os.sep, "/")
        prefix = "" if above == "." else f"{above}/"
        for name in names:
            if not name.startswith(".") and name.lower().endswith(MESH_SUFFIXES):
                yield prefix + name
