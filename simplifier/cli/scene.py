"""The commands on scenes of many objects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.cli.console import count_bar, print_rows
from simplifier.cli.options import SceneArgument, TransparentScene, read_options, with_options
from simplifier.cli.running import Debug, interrupts, run_guarded
from simplifier.geometry import scene as scenes
from simplifier.hierarchy.occluder_tree import leaf_occluders
from simplifier.hierarchy.packed_file import PACKED_FILE, current_packed, write_packed
from simplifier.hierarchy.scene_build import Build, build_occluders
from simplifier.hierarchy.scene_file import (
    load_occluder_tree,
    occluder_store,
    read_summaries,
    write_manifest,
)
from simplifier.io.files import check_folder, make_folder, write_whole
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import SceneOptions


@with_options(SceneOptions)
def scene(
    source: SceneArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for scene.json and the occluders.")
    ],
    *,
    packed: Annotated[
        Path | None,
        typer.Option(
            help="Write the tree and all occluders to this file for engines, too (.occs);"
            " it is always written to scene.occs in the folder."
        ),
    ] = None,
    transparent: TransparentScene = "leave-out",
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make a tree of occluders for a scene of many objects.

    What was made before for the same input is kept, so an interrupted run goes on where it was, and
    a changed object costs its own occluders and those above it.
    """

    def run() -> None:
        options = read_options(SceneOptions, chosen)
        if packed is not None:
            check_folder(packed)  # now, not when all is made
        with interrupts() as listening:
            read = load_scene(source, transparent=transparent, memory_limit=options.memory_limit)
            make_folder(output)  # a scene that cannot be read leaves nothing behind
            with listening.deferred() as cancel, count_bar("occluders") as tell:
                build = build_occluders(
                    read, options, occluder_store(output), read_summaries(output), tell, cancel,
                    options.memory_limit,
                )  # fmt: skip
            with listening.held():
                write_manifest(output, read, options, build)
                data = _write_tree(output, options.preview)
                if packed is not None:
                    write_whole(packed, data)
            print_rows(
                str(output),
                _summary_rows(read, build, len(data)),
                [*read.warnings, *build.warnings],
            )

    run_guarded(run, debug=debug)


def _write_tree(output: Path, preview: bool) -> bytes:
    """Write what is made of ``scene.json`` and the occluders; the bytes of ``scene.occs``."""
    data = current_packed(output)
    if data is None or preview:
        tree = load_occluder_tree(output)
        data = data or write_packed(output, tree)
        if preview:
            write_scene(leaf_occluders(tree), output / "preview.glb")
    return data


def _summary_rows(read: scenes.Scene, build: Build, packed: int) -> list[tuple[str, str]]:
    far = sum(keys.far is not None for keys in build.keys)
    near = sum(keys.near is not None for keys in build.keys)
    triangles = sum(one.triangles for one in build.summaries.values())
    return [
        ("objects", f"{len(read):,}"),
        ("parts", f"{len(build.parts.object_of):,}"),
        ("triangles", f"{int(read.triangle_counts.sum()):,}"),
        ("nodes", f"{len(build.tree):,}, of which {far:,} with a far and {near:,} a near occluder"),
        ("occluders", f"{len(build.summaries):,} of {triangles:,} triangles"),
        ("made now", f"{build.made:,}, {build.kept:,} kept from before"),
        ("for engines", f"{PACKED_FILE}, {packed:,} bytes"),
    ]
