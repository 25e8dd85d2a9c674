"""Which overrides a command on one mesh works with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simplifier.cli.help import INPUT
from simplifier.errors import OptionError
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.io.overrides import load_overrides, overrides_of
from simplifier.io.suffixes import overrides_beside

OverridesFile = Annotated[
    Path | None,
    typer.Option(
        "--overrides",
        help="Parts drawn by hand, regions to keep open and meshes to ignore: a TOML file.",
        show_default="MESH.overrides.toml beside the mesh, if it is there",
        rich_help_panel=INPUT,
    ),
]
NoOverrides = Annotated[
    bool,
    typer.Option(
        "--no-overrides",
        help="Ignore the file of overrides beside the mesh.",
        rich_help_panel=INPUT,
    ),
]


def chosen_overrides(mesh: Path, file: Path | None, none: bool) -> Overrides:
    """Those of the file that was named, or else of the one beside the mesh, if it is there.

    Raises :class:`~simplifier.errors.OptionError` where a file and none are asked for, and
    :class:`~simplifier.errors.OverridesError` as reading does.
    """
    if file is not None and none:
        raise OptionError(
            "cannot be given together with --no-overrides",
            where="overrides",
            remedy="choose one of the two",
        )
    if none:
        return NO_OVERRIDES
    return overrides_of(mesh) if file is None else load_overrides(file)


def overrides_used(mesh: Path, file: Path | None, none: bool) -> Path | None:
    """The file that :func:`chosen_overrides` reads, if it reads one."""
    if none:
        return None
    return overrides_beside(mesh) if file is None else file
