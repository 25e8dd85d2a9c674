"""Docstrings as Markdown, for mkdocstrings.

They are prose with roles of Sphinx (``:class:`Mesh```) and columns of names with what each is.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

_ROLE = re.compile(r":\w+:`~?\.?([^`]+)`")
_ENTRY = re.compile(r"(``[^`]+``(?:,? (?:and )?``[^`]+``)*)  +(\S.*)")


def as_markdown(text: str) -> str:
    """A docstring with roles as code, and with columns as lists."""
    text = _ROLE.sub(lambda found: f"`{found[1]}`", text)
    return "\n\n".join(map(_block, text.split("\n\n")))


def _block(block: str) -> str:
    """A list, if the block is a column of names; else the block itself."""
    lines = block.splitlines()
    if not lines or not _ENTRY.match(lines[0]):
        return block
    entries: list[str] = []
    for line in lines:
        found = _ENTRY.match(line)
        if found:
            entries.append(f"- {found[1]}: {found[2]}")
        elif line.startswith(" "):
            entries[-1] += f" {line.strip()}"
        else:
            return block
    return "\n".join(entries)


class Docstrings(griffe.Extension):
    """Makes Markdown of each docstring as it is read."""

    def on_object(self, *, obj: Any, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = as_markdown(obj.docstring.value)
