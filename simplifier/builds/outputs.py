"""Where an asset's occluders go, by templates as ``occluders/{folder}/{name}.glb``, and how."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simplifier.errors import ManifestError
from simplifier.io.places import is_folder
from simplifier.io.suffixes import OCCLUDER_SUFFIXES, QUAD_SUFFIXES
from simplifier.options.fields import OptionSet, shared
from simplifier.options.simplify import Embedding, Sides, WriteOptions

_FIELD = re.compile(r"\{([^{}]*)\}")
_LEVEL = re.compile(r"(.*)_lod(?:0|[1-9][0-9]*)(\.[^./]*)")


@dataclass(frozen=True)
class Output(OptionSet):
    """A file and how it is written.

    ``file``  relative to the manifest's folder; in a template with ``{name}`` and so on.
    """

    file: str
    sides: Sides = shared(WriteOptions, "sides")
    as_quads: bool = shared(WriteOptions, "as_quads")
    with_original: Embedding | None = shared(WriteOptions, "with_original")

    @property
    def written(self) -> dict[str, Any]:
        """What of it is not as it is where nothing is said, as JSON has it."""
        values = ((one.name, getattr(self, one.name), one.default) for one in self.fields())
        return {name: value for name, value, default in values if value != default}


def outputs_of(mesh: str, templates: Iterable[Output], where: str) -> tuple[Output, ...]:
    """Of a mesh, by its path relative to the manifest's folder; ``{folder}`` and ``{name}`` are the
    mesh's, ``{suffix}`` is its own without the dot.

    Raises :class:`ManifestError`, at ``where``, for a template that leads out of the folder, holds
    an unknown field or ends as no occluder does, or not as it is to be written.
    """

    def fill_template(template: Output) -> Output:
        text = template.file
        path = posixpath.normpath(fill_fields(text, mesh, where))
        if "\0" in text:
            raise _output_error(text, "holds a NUL character", where)
        if path.startswith(("/", "../")) or "\\" in text or ":" in path.split("/")[0]:
            raise _output_error(text, "leads out of the manifest's folder", where)
        if posixpath.splitext(path)[1].lower() not in OCCLUDER_SUFFIXES:  # ".glb" is a name
            raise _output_error(text, "does not end as an occluder's file does", where)
        _check_format(template, path.lower(), where)
        return replace(template, file=path)

    return tuple(fill_template(template) for template in templates)


def is_for_many(output: Path) -> bool:
    """Whether any number of meshes may go to an output: it is a folder or a template.

    What has no suffix is no file that could be written.
    """
    return is_folder(output) or not output.suffix or is_template(output)


def is_template(output: Path) -> bool:
    """Whether a field of a mesh is in it."""
    return any(f"{{{field}}}" in str(output) for field in ("folder", "name", "suffix"))


def fill_fields(text: str, mesh: str, where: str) -> str:
    """``text`` with the fields of a mesh.  Raises :class:`ManifestError` for an unknown one."""
    folder, file = posixpath.split(mesh)
    name, suffix = posixpath.splitext(file)
    values = {"folder": folder or ".", "name": name, "suffix": suffix[1:]}
    for field in _FIELD.findall(text):
        if field not in values:
            raise _output_error(text, f"has no {{{field}}}", where)
    return _FIELD.sub(lambda found: values[found[1]], text)


def level_base(path: str) -> str | None:
    """The output that a path may hold a level of detail of: of ``a_lod2.glb`` it is ``a.glb``."""
    found = _LEVEL.fullmatch(path)
    return found[1] + found[2] if found else None


def _check_format(template: Output, path: str, where: str) -> None:
    if template.as_quads and not path.endswith(QUAD_SUFFIXES):
        what = f"the output '{template.file}' is of a format without quads"
        remedy = f"end it in one of {' '.join(QUAD_SUFFIXES)}, or take as_quads out"
        raise ManifestError(what, where=where, remedy=remedy)
    if template.with_original is not None and not path.endswith(".glb"):
        what = f"the output '{template.file}' cannot hold the original"
        raise ManifestError(what, where=where, remedy="end it in .glb, or take with_original out")


def _output_error(template: str, what: str, where: str) -> ManifestError:
    known = " ".join(OCCLUDER_SUFFIXES)
    return ManifestError(
        f"the output '{template}' {what}",
        where=where,
        remedy="write as in '{folder}/{name}_occluder.glb', with {folder}, {name}, {suffix} of the "
        f"mesh and one of {known}",
    )
