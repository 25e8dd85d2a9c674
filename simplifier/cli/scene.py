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
from simplifier.hierarchy.scene_build import Build, build_occluders
from simplifier.hierarchy.scene_file import (
    load_occluder_tree,
    occluder_store,
    read_summaries,
    write_manifest,
)
from simplifier.io.files import make_folder
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
                if options.preview:
                    tree = load_occluder_tree(output)
                    write_scene(leaf_occluders(tree), output / "preview.glb")
            print_rows(str(output), _summary_rows(read, build), [*read.warnings, *build.warnings])

    run_guarded(run, debug=debug)


def _summary_rows(read: scenes.Scene, build: Build) -> list[tuple[str, str]]:
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
    ]
