"""A file -> what sets are found in, a scene of meshes or an elevation model, and its view cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.elevation import load_elevation
from simplifier.io.places import is_folder
from simplifier.io.scene_layers import load_layers
from simplifier.io.suffixes import ELEVATION_SUFFIXES
from simplifier.options.simplify import Transparent
from simplifier.options.visibility import ElevationOptions, Placing, PvsOptions
from simplifier.visibility.columns.tile_cells import tiles_as_cells
from simplifier.visibility.placing.cells import load_cells, place_cells
from simplifier.visibility.placing.terrain_cells import place_columns, place_on_terrain
from simplifier.visibility.solid.terrain import Terrain


@dataclass(frozen=True, eq=False)
class CellsInput:
    """What sets are found in, and by; as :func:`~simplifier.visibility.find.find_pvs` has it."""

    upright: UprightScene
    cells: ViewCells
    options: PvsOptions
    opaque: Scene | None
    terrain: Terrain | None


@dataclass(frozen=True, eq=False)
class SceneInput:
    """``scene``    all objects: those of a file, or the tiles of an elevation model.
    ``opaque``   what of them hides anything, by their names; None is all.
    ``terrain``  what the scene was made of, if it is one.
    """

    scene: Scene
    opaque: Scene | None
    terrain: Terrain | None

    def with_cells(self, cells: Placing | Path, options: PvsOptions) -> CellsInput:
        """Cells where one can walk, as a placing says, or those of a file.

        Those that were placed are left out where they are buried, for no user put them there.
        Raises :class:`OptionError`, and what reading the file does.
        """
        upright = UprightScene.of(self.scene, options.up)
        if isinstance(cells, Path):
            places = load_cells(cells, options.up, upright.origin)
        else:
            places = self._placed(upright, cells, options)
            options = replace(options, skip_buried=True)
        return CellsInput(upright, places, options, self.opaque, self.terrain)

    def _placed(self, upright: UprightScene, placing: Placing, options: PvsOptions) -> ViewCells:
        if self.terrain is None:
            return place_cells(upright, placing, options)
        if options.method == "voxel-column" or tiles_as_cells(self.terrain, options):
            return place_columns(self.terrain, upright, placing, options)
        return place_on_terrain(self.terrain, upright, placing, options)


def is_elevation(path: Path) -> bool:
    """Whether a path is taken for an elevation model, by its suffix."""
    return path.suffix.lower() in ELEVATION_SUFFIXES and not is_folder(path)


def read_input(
    path: Path,
    transparent: Transparent,
    elevation: ElevationOptions,
    memory_limit: float | None,
    *,
    allow_external: bool = True,
) -> SceneInput:
    """Raises what reading a scene and an elevation model does, and :class:`OptionError`.

    ``allow_external``  whether a scene may refer to other files.
    """
    if is_elevation(path):
        posts = load_elevation(path, spacing=elevation.spacing, memory_limit=memory_limit)
        terrain = Terrain.of(posts, elevation.tile)
        return SceneInput(terrain.scene, None, terrain)
    if elevation.spacing is not None:
        raise OptionError(
            "a scene of meshes has none", where="spacing",
            remedy="leave it out, or name an elevation model: .npy or .tif",
        )  # fmt: skip
    scene, opaque = load_layers(
        path, transparent=transparent, memory_limit=memory_limit, allow_external=allow_external
    )
    return SceneInput(scene, opaque, None)
