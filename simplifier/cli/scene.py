"""The command that makes the occluders of a scene of many objects."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.builds.digests import Digests
from simplifier.builds.making import scene_stamp
from simplifier.cli.console import print_closing, print_json, print_rows
from simplifier.cli.current import Making
from simplifier.cli.help import OUTPUT, with_examples
from simplifier.cli.options import (
    PoolName,
    SceneArgument,
    TransparentScene,
    read_options,
    with_options,
)
from simplifier.cli.running import AsJson, Debug, Quiet, interrupts, run_guarded
from simplifier.errors import OptionError
from simplifier.io.files import check_apart, check_folder, read_bytes, write_whole
from simplifier.options.scene import SceneOptions
from simplifier.options.simplify import Transparent
from simplifier.wording import command_line, count


@with_examples(
    ("occluder scene town.glb -o town", "Make occluders for every object of a scene."),
    (
        "occluder scene town.glb -o town --up z --ground",
        "The same, for a scene whose z axis is up and whose buildings stand on the ground.",
    ),
    (
        "occluder scene town.glb -o town --budget 32 --preview",
        "Use fewer triangles, and write preview.glb to look at.",
    ),
)
@with_options(SceneOptions)
def scene(
    source: SceneArgument,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            help="Folder for scene.json and the occluders.",
            rich_help_panel=OUTPUT,
        ),
    ],
    *,
    packed: Annotated[
        Path | None,
        typer.Option(
            help="Also write the tree and all occluders to this file, for engines (.occs). The"
            " folder always has them as scene.occs.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    frame_triangles: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Rank the occluders in the files for engines, for frames of so many occluder"
            " triangles, by what each hides along a path.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            help="The camera path to rank along. Without one, a walk is made.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    transparent: TransparentScene = "leave-out",
    pool: PoolName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make a tree of occluders for a scene of many objects.

    Occluders that are current are kept. An interrupted run continues where it stopped, and after a
    change of one object only its own occluders and those above it are made again.
    """

    def run() -> None:
        options = read_options(SceneOptions, chosen)
        if packed is not None:
            check_folder(packed)  # now, not when all is made
            check_apart([packed], "the packed tree", [(source, "the scene itself")])
        if path is not None and frame_triangles is None:
            raise OptionError(
                "a path is for ranking", where="--path", remedy="give --frame-triangles, too"
            )
        digest = None if path is None else Digests().of(path)
        also = {"transparent": transparent, "frame_triangles": frame_triangles, "path": digest}
        making = Making.of(scene_stamp(source), output, None, options, also=also)
        told = making.current()
        ranked = told is None and frame_triangles is not None
        if told is None:
            from simplifier.cli.scene_making import make_scene  # what is current need not load
            from simplifier.pools import pool_named

            with _rare_collections(), interrupts() as listening, pool_named(pool) as shared:
                made = make_scene(
                    source, output, options, transparent, (frame_triangles, path), listening,
                    shared,
                )  # fmt: skip
            told = made.told
            making.keep(made.files, made.told_again)
        if packed is not None:
            from simplifier.hierarchy.packed_file import PACKED_FILE

            write_whole(packed, read_bytes(output / PACKED_FILE))
        print_rows(str(output), told["rows"], told["warnings"])
        print_closing(
            _made(output, told, ranked=ranked),
            _NOT_MEASURED,
            _then(source, output, options, transparent),
        )
        print_json(told["figures"])

    run_guarded(run, debug=debug, quiet=quiet, as_json=as_json)


@contextmanager
def _rare_collections() -> Iterator[None]:
    """Look for garbage rarely: a scene is hundreds of thousands of objects of Python, and to go
    through them again and again takes a tenth of a small change."""
    before = gc.get_threshold()
    gc.set_threshold(1_000_000, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


_NOT_MEASURED = "not measured yet: how much the occluders hide depends on the camera"


def _made(output: Path, told: Mapping[str, Any], *, ranked: bool) -> str:
    made, kept = told["figures"]["made"], told["figures"]["kept"]
    if not made:
        new = "ranks alone" if ranked else "nothing"
        return f"{new}; all {count(kept, 'occluder')} in {output} are current"
    return f"{count(made, 'occluder')} in {output}; {kept:,} were current"


def _then(source: Path, output: Path, options: SceneOptions, transparent: Transparent) -> str:
    """How to find out what they hide."""
    walk, culled = Path(f"{output}_walk.json"), Path(f"{output}_cull")
    up = [] if options.up == "y" else ["--up", options.up]
    same = [] if transparent == "leave-out" else ["--transparent", transparent]
    place = command_line(["occluder", "path", source, "-o", walk, *up, *same])
    measure: list[str | Path] = ["occluder", "cull", source, "--occluders", output]
    measure += ["--path", walk, "-o", culled]
    return f"{place} && {command_line([*measure, *same])}"
