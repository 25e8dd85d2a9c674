"""Which overrides a command on one mesh works with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from simplifier.errors import OptionError
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.io.overrides import load_overrides, overrides_of

OverridesFile = Annotated[
    Path | None,
    typer.Option(
        "--overrides",
        help="Parts drawn by hand, regions to leave open, what to ignore: a TOML file.",
        show_default="MESH.overrides.toml beside the mesh, if it is there",
    ),
]
NoOverrides = Annotated[
    bool, typer.Option("--no-overrides", help="Do not look at the file beside the mesh.")
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
