"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table, or nothing without rows; cells may hold Markdown of one line."""
    lines = [_row(one) for one in rows]
    if not lines:
        return ""
    return "\n".join([_row(heads), "|" + "---|" * len(heads), *lines])


def page(*parts: str) -> str:
    """Blocks of Markdown as one text; those that are empty are left out."""
    return "\n\n".join(one for one in parts if one) + "\n"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(" ".join(one.split()).replace("|", "\\|") for one in cells) + " |"
