"""The library's reference: the names of ``simplifier/__init__.pyi``, a page a subject."""

from __future__ import annotations

import re

from website.repository import ROOT
from website.tables import page

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
            *(f"::: {one}" for one in names),
        )
    return made
