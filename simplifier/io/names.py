"""Names that each stand for one object."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

_NAMED = 5  # how many a warning lists


def unique_names(names: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """The names with ".2", ".3", ... put to what repeats, and one warning if anything did.

    What stands for no character (half of one in a file's JSON, a byte of another encoding in the
    name of a file) becomes "?": no report or table could be written with it.
    The first of a name keeps it, and no number makes a name that another object has from the start.
    """
    names = [encodable(name) for name in names]
    counts = Counter(names)
    if len(counts) == len(names):
        return tuple(names), []
    taken = set(counts)
    used: Counter[str] = Counter()
    result = []
    for name in names:
        used[name] += 1
        own = name
        if used[name] > 1:
            while own in taken:
                own = f"{name}.{used[name]}"
                used[name] += own in taken
            taken.add(own)
        result.append(own)
    repeated = [f"{count} are called '{name}'" for name, count in counts.items() if count > 1]
    return tuple(result), [
        f"names of objects repeat: {listed(repeated)}; they were numbered ('{_example(counts)}.2'),"
        " so give each its own name if you address objects by name"
    ]


def encodable(name: str) -> str:
    """The name with "?" for what UTF-8 cannot write."""
    return name if name.isascii() else name.encode("utf-8", "replace").decode("utf-8")


def _example(counts: Counter[str]) -> str:
    return next(name for name, count in counts.items() if count > 1)


def listed(items: Sequence[str]) -> str:
    """The first few, and how many more there are."""
    more = len(items) - _NAMED
    return ", ".join(items[:_NAMED]) + (f" and {more} more" if more > 0 else "")
