"""Where an asset's occluders go, by templates such as ``occluders/{folder}/{name}.glb``."""

from __future__ import annotations

import posixpath
import re

from simplifier.asset_build.settings import Setting
from simplifier.errors import ManifestError
from simplifier.suffixes import OCCLUDER_SUFFIXES

_FIELD = re.compile(r"\{([^{}]*)\}")
_LEVEL = re.compile(r"(.*)_lod(?:0|[1-9][0-9]*)(\.[^./]*)")


def outputs_of(mesh: str, templates: Setting) -> tuple[str, ...]:
    """Paths relative to the manifest's folder, of a mesh that is, too; ``{folder}`` and ``{name}``
    are the mesh's, ``{suffix}`` is its own without the dot.

    Raises :class:`ManifestError` for a template that leads out of the folder, holds an unknown
    field or ends as no occluder does.
    """
    folder, file = posixpath.split(mesh)
    name, suffix = posixpath.splitext(file)
    fields = {"folder": folder or ".", "name": name, "suffix": suffix[1:]}

    def filled(template: str) -> str:
        for field in _FIELD.findall(template):
            if field not in fields:
                raise _refused(template, f"has no {{{field}}}", templates.where)
        path = posixpath.normpath(_FIELD.sub(lambda found: fields[found[1]], template))
        if path.startswith(("/", "../")) or "\\" in template or ":" in path.split("/")[0]:
            raise _refused(template, "leads out of the manifest's folder", templates.where)
        if not path.lower().endswith(OCCLUDER_SUFFIXES):
            raise _refused(template, "does not end as an occluder's file does", templates.where)
        return path

    return tuple(filled(template) for template in templates.value)


def level_base(path: str) -> str | None:
    """The output that a path may hold a level of detail of: of ``a_lod2.glb`` it is ``a.glb``."""
    found = _LEVEL.fullmatch(path)
    return found[1] + found[2] if found else None


def _refused(template: str, what: str, where: str) -> ManifestError:
    known = " ".join(OCCLUDER_SUFFIXES)
    return ManifestError(
        f"the output '{template}' {what}",
        where=where,
        remedy="write as in '{folder}/{name}_occluder.glb', with {folder}, {name}, {suffix} of the "
        f"mesh and one of {known}",
    )
