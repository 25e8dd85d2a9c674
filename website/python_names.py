"""The library's reference: the names of ``simplifier/__init__.pyi``, a page a subject."""

from __future__ import annotations

import re
from collections.abc import Iterator

import simplifier
from website.repository import ROOT
from website.tables import page, table

FOLDER = "reference/python"
SUBJECTS: dict[str, tuple[str, ...]] = {
    "Make and measure": ("api", "production", "accuracy", "report", "memory", "progress", "warmup"),
    "Options": ("options",),
    "Meshes and occluders": ("geometry",),
    "Read and write": ("io",),
    "Scenes and culling": ("hierarchy", "culling"),
    "Trade-off": ("tradeoff",),
    "Errors": ("errors",),
}
"""Titles of the pages, and the packages whose names are on each."""

_KINDS = {
    "choice": "one of", "flag": "bool", "lengths": "list of float", "number": "float",
    "numbers": "list of float", "size": "(int, int)", "whole": "int", "wholes": "list of int",
}  # fmt: skip

_NAME = re.compile(r"^from \.([\w.]+) import (\w+) as \w+$", re.MULTILINE)


def exported() -> list[str]:
    """Where each exported name is, as ``simplifier.api.simplify``, in the list's order."""
    text = (ROOT / "simplifier" / "__init__.pyi").read_text(encoding="utf-8")
    return [f"simplifier.{module}.{name}" for module, name in _NAME.findall(text)]


def pages() -> dict[str, str]:
    """Each subject's page by its place."""
    made = {}
    for title, packages in SUBJECTS.items():
        names = [one for one in exported() if one.split(".")[1] in packages]
        file = title.lower().replace(" ", "_").replace("-", "_")
        made[f"{FOLDER}/{file}.md"] = page(
            f"# {title}",
            "All names are those of `simplifier` itself: `simplifier.NAME`.",
            *(part for one in names for part in _described(one)),
        )
    return made


def _described(name: str) -> Iterator[str]:
    """What mkdocstrings makes of a name, and below a class of options the table of them."""
    yield f"::: {name}"
    found = getattr(simplifier, name.rpartition(".")[2], None)
    if isinstance(found, type) and issubclass(found, simplifier.OptionSet):
        yield table(("field", "kind", "default", "what it does"), map(_field, _fields(found)))


def _fields(options: type[simplifier.OptionSet]) -> tuple[simplifier.OptionField, ...]:
    return () if options is simplifier.OptionSet else tuple(options.fields())


def _field(one: simplifier.OptionField) -> tuple[str, str, str, str]:
    kind = " ".join([_KINDS[one.kind], ", ".join(f"`{word}`" for word in one.choices)]).strip()
    limits = [f"{word} {limit:,}" for word, limit in _limits(one) if limit is not None]
    default = f"`{one.default}`" + (f" ({one.absent})" if one.absent else "")
    return f"`{one.name}`", ", ".join([kind, *limits]), default, one.help


def _limits(one: simplifier.OptionField) -> Iterator[tuple[str, float | None]]:
    yield ("above" if one.low_excluded else "at least"), one.low
    yield "at most", one.high
