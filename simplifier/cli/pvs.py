"""The commands on what is visible from view cells."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from simplifier.cli.console import (
    count_bar,
    print_closing,
    print_json,
    print_line,
    print_progress,
    print_rows,
    print_text,
)
from simplifier.cli.help import INPUT, OUTPUT, with_examples
from simplifier.cli.options import PoolName, TerrainArgument, read_options, with_options
from simplifier.cli.running import INTERRUPTED, AsJson, Debug, Quiet, interrupts, run_guarded
from simplifier.errors import OptionError
from simplifier.io.places import followed, is_file, is_there
from simplifier.options.simplify import Transparent
from simplifier.options.visibility import SEE_THROUGH_HELP, ElevationOptions, PvsOptions
from simplifier.wording import command_line, duration

if TYPE_CHECKING:
    from simplifier.camera_paths.columns import UprightScene
    from simplifier.options.visibility import Placing
    from simplifier.visibility.cost import Cost
    from simplifier.visibility.find import Found
    from simplifier.visibility.method import Sight

PvsFile = Annotated[Path, typer.Argument(help="What 'occluder pvs' wrote.")]
SeenThrough = Annotated[Transparent, typer.Option(help=SEE_THROUGH_HELP)]
_SOME = 40  # names that are shown of a set
_DRAWN = ("auto", "cull-map", "voxel-column", "strong")


@with_examples(
    (
        "occluder pvs town.glb -o town.pvs --up z --ground",
        "Find the visible sets of a town whose buildings stand on the ground.",
    ),
    (
        "occluder pvs rooms.glb -o rooms.pvs --cells floors --method slice-wise",
        "Find those of rooms, for viewers on the floors.",
    ),
    (
        "occluder pvs heights.npy -o heights.pvs --spacing 10,10",
        "Find those of an elevation model whose posts are 10 units apart.",
    ),
)
@with_options(PvsOptions, ElevationOptions)
def pvs(
    scene: TerrainArgument,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="The file of sets to write, .pvs.", rich_help_panel=OUTPUT
        ),
    ],
    *,
    cells: Annotated[
        str,
        typer.Option(
            help="Where view cells lie: walkable, grid, triangles, floors (of rooms), or a JSON"
            " file of cells.",
            rich_help_panel=INPUT,
        ),
    ] = "walkable",
    report: Annotated[
        Path | None,
        typer.Option(help="Write the figures to this file, as JSON.", rich_help_panel=OUTPUT),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            help="Draw plans of the sets and of what hides into this folder.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    pool: PoolName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Find which objects of a scene can be seen from each view cell, before run time.

    The objects of an elevation model are square tiles, and z is up.

    An existing file is continued. Cells that it holds are not computed again. Press Ctrl-C to stop
    and keep what is done. From a cell that is not computed, everything counts as visible.
    """

    def run() -> None:
        # Here, not above: what it needs of scipy takes longer to load than the help.
        from simplifier.cli.path import check_output
        from simplifier.cli.pvs_parts import parts_rows
        from simplifier.cli.report import check_extras
        from simplifier.io.pvs_file import load_pvs, save_pvs
        from simplifier.pools import pool_named
        from simplifier.visibility.find import Watch, find_pvs
        from simplifier.visibility.report import pvs_report
        from simplifier.visibility.scene_input import is_elevation, read_input

        options: PvsOptions = read_options(PvsOptions, chosen)
        elevation: ElevationOptions = read_options(ElevationOptions, chosen)
        if is_elevation(scene):
            options = replace(options, up="z")
        check_output(scene, output, "the sets")
        others = [(scene, "the scene itself"), (output, "the sets")]
        check_extras(report, pictures, others)
        if pictures is not None and options.method not in _DRAWN:
            raise OptionError(
                "sets by slices are not drawn", where="pictures",
                remedy="leave --pictures out, or choose another method",
            )  # fmt: skip
        with interrupts() as listening, pool_named(pool) as shared:
            before = load_pvs(output) if is_there(output) else None
            read = read_input(scene, options.transparent, elevation, options.memory_limit)
            asked = read.with_cells(_placing_or_file(cells), options)
            with listening.deferred() as cancel, count_bar("objects, then cells") as tell:
                found = find_pvs(
                    asked.upright, asked.cells, asked.options, before,
                    Watch(tell, tell, _tell_cost, print_progress, cancel),
                    opaque=asked.opaque, terrain=asked.terrain, pool=shared,
                )  # fmt: skip
            with listening.held():
                save_pvs(found.pvs, output)
                figures = pvs_report(found)
                if report is not None:
                    report.write_text(json.dumps(figures, indent=2) + "\n")
                if pictures is not None:
                    _write(pictures, _drawn(asked.upright, found, scene.name, options.seed))
                warnings = [*read.scene.warnings, *found.warnings]
                rows = [*_summary_rows(figures, output), *parts_rows(found.pvs)]
                print_rows(str(output), rows, warnings)
                words: list[str | Path] = ["occluder", "pvs-check", scene, output]
                then = command_line([*words, *_same_scene(elevation, options)])
                print_closing(_made(figures, output), _good(figures), then)
                print_json(figures)

    run_guarded(run, debug=debug, quiet=quiet, as_json=as_json)


def _same_scene(elevation: ElevationOptions, options: PvsOptions) -> Iterator[str]:
    """The options that say what the scene is, as they are typed, where one is not as by default."""
    if elevation.spacing is not None:
        yield from ("--spacing", ",".join(map(str, elevation.spacing)))
    if elevation.tile != ElevationOptions().tile:
        yield from ("--tile", str(elevation.tile))
    if options.transparent != PvsOptions().transparent:
        yield from ("--transparent", options.transparent)


def _made(figures: Mapping[str, Any], output: Path) -> str:
    cells, left = figures["cells"], figures["left"]
    rest = f"; {left:,} are left, and the same command continues" if left else ""
    if not figures["computed_now"] and not left:
        return f"nothing; {output} has the sets of all {cells:,} view cells already"
    return f"{output}, the visible sets of {cells - left:,} view cells{rest}"


def _good(figures: Mapping[str, Any]) -> str:
    """How good the sets are, in a line."""
    culled = f"{100.0 * figures['culled_share']:.2f} %"
    proven = "nothing visible is missing" if figures["conservative"] else "something may be missing"
    return f"{culled} of the objects are culled from a view cell, on average; {proven}"


def _drawn(upright: UprightScene, found: Found, name: str, seed: int) -> dict[str, bytes]:
    """The pictures of sets, by the names of their files."""
    from simplifier.visibility.pictures.horizons_picture import horizons_picture
    from simplifier.visibility.pictures.pictures import cells_picture, set_pictures
    from simplifier.visibility.pictures.slices_picture import slices_picture
    from simplifier.visibility.pictures.strong_picture import strong_picture

    if found.pvs.altitudes is None or found.maps is not None:
        made = set_pictures(upright, found.pvs, found.maps, name, seed)
        if found.pvs.slices is not None and (parted := slices_picture(upright, found.pvs, name)):
            made["slices.png"] = parted
        if found.occluders is not None:
            made["strong.png"] = strong_picture(upright, found.pvs, found.occluders, name)
        return made
    return {
        "horizons.png": horizons_picture(upright, found.pvs, name),
        "cells.png": cells_picture(found.pvs, name, upright),
    }


_LONG = 3600.0  # seconds, after which it is told how to be done sooner


def _tell_cost(sight: Sight, cost: Cost) -> None:
    """Before the cells that take most of the time."""
    print_text(f"{_method_words(sight.method, sight.conservative, sight.reason)}: {_words(cost)}")
    if cost.seconds > _LONG:
        print_line(
            f"warning: this will take {duration(cost.seconds)}; larger cells (--cell-size) are"
            " fewer, and Ctrl-C keeps what is done"
        )


def _method_words(method: str, conservative: bool, reason: str) -> str:
    return ", ".join([method, *([] if conservative else ["not conservative"]), reason])


def _words(cost: Cost) -> str:
    return f"{1e3 * cost.seconds_a_cell:.3g} ms a cell, {duration(cost.seconds)} in all"


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    from simplifier.io.files import make_folder, write_all_whole

    make_folder(folder)
    write_all_whole({folder / name: data for name, data in files.items()})


def _placing_or_file(cells: str) -> Placing | Path:
    if cells in ("walkable", "grid", "triangles", "floors"):
        return cast("Placing", cells)
    path = Path(cells)
    if not is_file(path):
        raise OptionError(
            f"'{cells}' is neither a way to place cells nor a file", where="cells",
            remedy="choose walkable, grid, triangles or floors, or name a JSON file of cells",
        )  # fmt: skip
    return path


def _summary_rows(figures: Mapping[str, Any], output: Path) -> list[tuple[str, str]]:
    from simplifier.visibility.cost import Cost

    cells, size = figures["cells"], output.stat().st_size
    done = cells - figures["left"]
    cost = _words(Cost(**figures["cost"]))
    if figures["foretold"] is not None:
        foretold = Cost(**figures["foretold"])
        cost += f"; foretold by {foretold.cells} of them: {_words(foretold)}"
    return [
        ("objects", f"{figures['objects']:,}"),
        ("cells", f"{done:,} of {cells:,}, {done - figures['computed_now']:,} kept from before"),
        (
            "method",
            _method_words(figures["method"], figures["conservative"], figures["reason"]),
        ),
        ("culled", f"{100.0 * figures['culled_share']:.2f} % of the objects in the mean"),
        ("file", f"{size:,} bytes, {size / done:,.0f} a cell"),
        ("time", cost),
    ]


def pvs_show(
    file: PvsFile,
    *,
    at: Annotated[
        str | None, typer.Option(help="Show what can be seen from this world point, X,Y,Z.")
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            help="Draw a plan of all cells, coloured by the size of their sets, into this folder."
        ),
    ] = None,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Show what a file of visible sets holds, or what can be seen from a point."""

    def run() -> None:
        from simplifier.cli.pvs_parts import parts_of, parts_rows
        from simplifier.io.pvs_file import load_pvs
        from simplifier.visibility.report import culled_share

        held = load_pvs(file)
        if pictures is not None:
            from simplifier.visibility.pictures.pictures import cells_picture

            _write(pictures, {"cells.png": cells_picture(held, file.name)})
        if at is None:
            done = len(held.computed)
            kind = "conservative" if held.conservative else "not conservative"
            rows = [
                ("objects", f"{len(held.names):,}"),
                ("cells", f"{len(held.cells):,}, {done:,} of them computed"),
                ("sets", f"{len(held.rows):,} different ones, {len(held.rows.data):,} bytes"),
                ("method", f"{held.method}, {kind}"),
                ("up axis", held.up),
                *parts_rows(held),
            ]
            if done:
                rows.append(
                    ("culled", f"{100.0 * culled_share(held):.2f} % of the objects in the mean")
                )
            print_rows(str(file), rows)
            return
        point = _point(at)
        cells = held.cells.containing(held.to_cells(point)).tolist()
        seen = held.visible(point)
        where = f"in cell {', '.join(map(str, cells))}" if cells else "outside of all cells"
        print_text(f"{at} is {where}: {int(seen.sum()):,} of {len(seen):,} objects can be seen")
        told = map("".join, zip(held.names, parts_of(held, cells), strict=True))
        names = [name for name, visible in zip(told, seen, strict=True) if visible]
        for name in names[:_SOME]:
            print_text(f"  {name}")
        if len(names) > _SOME:
            print_text(f"  and {len(names) - _SOME:,} more")

    run_guarded(run, debug=debug, quiet=quiet)


def _point(text: str) -> Any:
    import numpy as np

    try:
        point = np.array([float(word) for word in text.split(",")])
    except ValueError:
        point = np.empty(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise OptionError(f"'{text}' is not a point", where="at", remedy="give X,Y,Z")
    return point


@with_options(ElevationOptions)
def pvs_check(
    scene: TerrainArgument,
    file: PvsFile,
    *,
    cells: Annotated[
        int, typer.Option(min=1, help="Number of cells to check, chosen at random.")
    ] = 50,
    views: Annotated[int, typer.Option(min=1, help="Number of viewpoints in each cell.")] = 60,
    pictures: Annotated[
        int, typer.Option(min=0, help="Number of viewpoints in each cell to draw pictures from.")
    ] = 0,
    ground: Annotated[
        bool, typer.Option("--ground", help="Draw ground below the objects.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random choice.")] = 0,
    transparent: SeenThrough = "leave-out",
    quiet: Quiet = False,
    debug: Debug = False,
    **chosen: Any,
) -> None:
    """Check sets of visible objects against what is certainly seen from points in their cells.

    Exits with 1 where a visible object is missing, and with 130 if it was interrupted.
    """

    def run() -> None:
        from simplifier.culling.visible_sets import check_sets
        from simplifier.io.pvs_file import load_pvs
        from simplifier.visibility.checking.check import CheckOptions, check_pvs
        from simplifier.visibility.scene_input import read_input

        elevation: ElevationOptions = read_options(ElevationOptions, chosen)
        options = CheckOptions(cells, views, pictures=pictures, ground=ground, seed=seed)
        with interrupts() as listening:
            held = load_pvs(file)
            read = read_input(scene, transparent, elevation, None)
            check_sets(held, read.scene, read.opaque)
            with listening.deferred() as cancel, count_bar("cells") as tell:
                found = check_pvs(
                    read.scene, held, options,
                    lambda share: tell(round(share * cells), cells), cancel,
                    read.opaque, read.terrain,
                )  # fmt: skip
        rows = [
            ("cells", f"{len(found.rows):,} of {len(held.cells):,}"),
            ("leaks", f"{len(found.leaks):,}"),
            ("sets to what is seen", f"{found.excess:.3f}"),
            ("proven visible", f"{100.0 * found.proven_share:.1f} % of the sets"),
            ("culled", f"{100.0 * found.culled_share:.2f} % of the objects in the mean"),
            ("bytes of a set", f"{found.row_bytes:,.0f}"),
        ]
        print_rows(f"{followed(scene).name}, {file}", rows, read.scene.warnings)
        for leak in found.leaks[:_SOME]:
            lacks = "hides a part of" if leak.proof == "slice" else "does not have"
            how = "line" if leak.proof == "slice" else leak.proof
            print_line(
                f"leak: cell {leak.cell} {lacks} '{leak.name}', seen by {how} from"
                f" {', '.join(f'{value:.6g}' for value in leak.viewpoint)}"
            )
        asked = min(cells, len(held.computed))
        broken_off = len(found.rows) < asked
        if broken_off:
            print_line(f"error: interrupted after {len(found.rows):,} of {asked:,} cells")
        if found.leaks:
            raise typer.Exit(1)
        if broken_off:  # whoever asks for the status is not to take it for a pass
            raise typer.Exit(INTERRUPTED)

    run_guarded(run, debug=debug, quiet=quiet)
