"""The commands on scenes of many objects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from simplifier.camera_paths.options import PathKind, PathOptions
from simplifier.cli.console import count_bar, print_line, print_rows, print_text
from simplifier.cli.options import TransparentScene, with_options
from simplifier.cli.running import Debug, interrupts, run_guarded
from simplifier.errors import OutputError
from simplifier.geometry import scene as scenes
from simplifier.hierarchy.build import Build, build_occluders
from simplifier.hierarchy.manifest import (
    load_occluder_tree,
    occluder_store,
    read_summaries,
    write_manifest,
)
from simplifier.hierarchy.occluder_tree import leaf_occluders
from simplifier.hierarchy.options import SceneOptions
from simplifier.io.camera_path import save_camera_path
from simplifier.io.files import check_folder, make_folder
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.memory.limit import check_limit
from simplifier.option_fields import SCENE_FIELDS
from simplifier.options import Axis

SceneArgument = Annotated[
    Path, typer.Argument(help="The scene: a mesh file, objects by its nodes, or a folder of them.")
]


def path(
    scene: SceneArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="The camera path: a JSON file.")],
    kind: Annotated[
        PathKind,
        typer.Option(
            help="street: between the objects; roof: above them; inside: through rooms and doors."
        ),
    ] = "street",
    frames: Annotated[int, typer.Option(help="Cameras along the path.")] = 60,
    up: Annotated[Axis, typer.Option(help="The scene's up axis: x, y or z.")] = "y",
    eye_height: Annotated[
        float,
        typer.Option(
            help="Of the eyes over the ground, in the scene's units; all other lengths of the path "
            "are multiples of it. 1.7 where they are metres."
        ),
    ] = 1.7,
    fov: Annotated[float, typer.Option(help="Vertical field of view, degrees.")] = 60.0,
    transparent: TransparentScene = "leave-out",
    seed: Annotated[int, typer.Option(help="Another one gives another path.")] = 0,
    debug: Debug = False,
) -> None:
    """Write cameras along a walk or a flight through a scene, to judge occluders along."""

    def run() -> None:
        # Here, not above: what it needs of scipy takes longer to load than a small change to build.
        from simplifier.camera_paths.generate import generate_path

        PathOptions(kind, frames, up, seed, eye_height, fov)  # refused before the scene is read
        _check_output(scene, output)
        with interrupts() as listening:
            read = load_scene(scene, transparent=transparent)
            found = generate_path(read, kind, frames, up, seed, eye_height, fov)
            with listening.held():
                save_camera_path(found, output)
                for warning in read.warnings:
                    print_line(f"warning: {warning}")
                print_text(f"{output}: {len(found.cameras)} frames of kind {kind}")

    run_guarded(run, debug=debug)


def _check_output(scene: Path, output: Path) -> None:
    check_folder(output)
    if scene.resolve() == output.resolve():
        raise OutputError(
            "this is the scene itself", where=str(output), remedy="name another file for the path"
        )


@with_options(SCENE_FIELDS)
def scene(
    source: SceneArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Folder for scene.json and the occluders.")
    ],
    *,
    preview: bool,
    memory_limit: float | None,
    transparent: TransparentScene = "leave-out",
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Make a tree of occluders for a scene of many objects.

    What was made before for the same input is kept, so an interrupted run goes on where it was, and
    a changed object costs its own occluders and those above it.
    """

    def run() -> None:
        options = SceneOptions(**chosen)
        check_limit(memory_limit)
        with interrupts() as listening:
            read = load_scene(source, transparent=transparent, memory_limit=memory_limit)
            make_folder(output)  # a scene that cannot be read leaves nothing behind
            with listening.deferred() as cancel, count_bar("occluders") as tell:
                build = build_occluders(
                    read, options, occluder_store(output), read_summaries(output), tell, cancel,
                    memory_limit,
                )  # fmt: skip
            with listening.held():
                write_manifest(output, read, options, build)
                if preview:
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
