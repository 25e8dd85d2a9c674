"""A TOML file as values that know their lines, so that a fault in one can be pointed at."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from simplifier.errors import OccluderError, TomlError
from simplifier.io.files import read_bytes

_Place = tuple[str | int, ...]  # keys and places in arrays, from the top of the file

# Multi-line strings before the others; what a string or a comment holds ends no statement.
_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|[\[\]{}\n]",
    re.DOTALL,
)
# As above, whatever is no TOML too: what is open at the end goes to the end, so that the time is as
# the length.  Between two of the last row's there is one key, or one value with at most one dot.
_PIECE = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:\\.|[^"\\\n])*(?:"|(?=\n))'
    r"|'[^'\n]*(?:'|(?=\n))"
    r"|\#[^\n]*"
    r"|\."
    r"|[\[\]{},=\n]",
    re.DOTALL,
)
_MOST_PARTS = 64  # of a key; people write two or three
_AT_LINE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")


class Table(Mapping[str, Any]):
    """A table of a TOML file.

    Values are those of :mod:`tomllib`, but tables in it, at any depth, are of this class too.
    """

    def __init__(
        self, values: Mapping[str, Any], lines: Mapping[_Place, int], file: str, place: _Place = ()
    ) -> None:
        self._lines, self._place = lines, place
        self.file = file
        self._values = {key: self._known(value, (*place, key)) for key, value in values.items()}

    def _known(self, value: Any, place: _Place) -> Any:
        if isinstance(value, dict):
            return Table(value, self._lines, self.file, place)
        if isinstance(value, list):
            return [self._known(one, (*place, index)) for index, one in enumerate(value)]
        return value

    def __getitem__(self, key: str) -> Any:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def line(self, *keys: str | int) -> int:
        """Where a key's statement begins, 1 being the first; without keys, this table itself.

        Further keys, and places in arrays, lead deeper: ``line("box", 2, "size")``.  What stands
        inside of a value is where the value's statement begins, and so is what is not there.
        """
        place = (*self._place, *keys)
        while place and place not in self._lines:
            place = place[:-1]
        return self._lines.get(place, 1)

    def where(self, *keys: str | int) -> str:
        """``FILE:LINE`` of :meth:`line`, as errors name it."""
        return f"{self.file}:{self.line(*keys)}"


def read_toml(
    path: str | Path, *, name: str | None = None, error: type[OccluderError] = TomlError
) -> Table:
    """The top of a file that holds anything at all; messages call it ``name``, or by its path.

    Raises ``error``, by default :class:`~simplifier.errors.TomlError`, as :func:`parse_toml` and
    where there is no file to be read.
    """
    data = read_bytes(Path(path), error=error, remedy="name a TOML file")
    return parse_toml(data, name or str(path), error=error)


def parse_toml(data: bytes, file: str, *, error: type[OccluderError] = TomlError) -> Table:
    """The top of a file that messages call ``file``.

    Raises ``error``, by default :class:`~simplifier.errors.TomlError`, with file and line, for what
    is no UTF-8 and no TOML.
    """
    try:
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as fault:
        line = data.count(b"\n", 0, fault.start) + 1
        raise error("is not UTF-8", where=f"{file}:{line}", remedy="save it as UTF-8") from None
    _check_parts(text, file, error)
    try:
        return Table(tomllib.loads(text), _lines(text), file)
    except tomllib.TOMLDecodeError as fault:
        raise _no_toml(str(fault), text, file, error) from None
    except ValueError:  # of int, which takes no more digits than the interpreter allows
        raise error(
            "has a number of thousands of digits", where=file, remedy="write a shorter one"
        ) from None
    except RecursionError:
        raise error("is nested too deeply", where=file, remedy="write it flat") from None


def _check_parts(text: str, file: str, error: type[OccluderError]) -> None:
    """Before it is read: the standard reader takes time as the square of a key's parts."""
    dots = 0
    for piece in _PIECE.finditer(text + "\n"):
        if piece[0] == ".":
            dots += 1
            if dots >= _MOST_PARTS:
                line = text.count("\n", 0, piece.start()) + 1
                raise error(
                    f"has a key of more than {_MOST_PARTS} parts",
                    where=f"{file}:{line}",
                    remedy="write it with fewer dots",
                )
        elif piece[0] in "[]{},=\n":
            dots = 0


def _no_toml(message: str, text: str, file: str, error: type[OccluderError]) -> OccluderError:
    found = _AT_LINE.search(message)
    line = found[1] if found and found[1] else text.rstrip("\n").count("\n") + 1
    what = _AT_LINE.sub("", message)
    return error(
        f"this is no TOML: {what[:1].lower()}{what[1:]}",
        where=f"{file}:{line}",
        remedy="correct it",
    )


def _lines(text: str) -> dict[_Place, int]:
    """The first line of each key and table, each header and each ``key = value`` read by itself."""
    lines: dict[_Place, int] = {}
    inside: _Place = ()
    arrays: dict[_Place, int] = {}  # how many tables each has so far
    for line, statement in _statements(text):
        keys = _keys(tomllib.loads(statement))
        if statement[0] != "[":
            place = inside
            for key in keys:
                place = (*place, key)
                lines.setdefault(place, line)
            continue
        place = ()
        for key in keys[:-1]:
            place = _latest((*place, key), arrays)
            lines.setdefault(place, line)
        inside = (*place, keys[-1])
        if statement.startswith("[["):
            lines.setdefault(inside, line)
            arrays[inside] = arrays.get(inside, 0) + 1
            inside = _latest(inside, arrays)
        lines[inside] = line
    return lines


def _latest(place: _Place, arrays: Mapping[_Place, int]) -> _Place:
    """The table that a header's name leads to: of an array of tables the last."""
    return (*place, arrays[place] - 1) if place in arrays else place


def _keys(values: Any) -> tuple[str, ...]:
    """The dotted key of a statement that was read by itself."""
    keys: list[str] = []
    while isinstance(values, dict) and len(values) == 1:
        key, values = next(iter(values.items()))
        keys.append(key)
    return tuple(keys)


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """The line and the text of each header and of each ``key = value``, of text that is TOML."""
    begin, line, depth, begun_at = 0, 1, 0, 1
    for token in _TOKEN.finditer(text + "\n"):
        found = token[0]
        if found in ("[", "{"):
            depth += 1
        elif found in ("]", "}"):
            depth -= 1
        line += found.count("\n")
        if found == "\n" and depth == 0:
            statement = text[begin : token.start()].strip()
            if statement and statement[0] != "#":
                yield begun_at, statement
            begin, begun_at = token.end(), line
