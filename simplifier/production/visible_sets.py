"""A scene's file -> its visible sets, to be saved, reported and shown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.camera_paths.columns import UprightScene
from simplifier.checks import as_path, check_callable, check_cancel, check_flag
from simplifier.geometry.pvs import Pvs
from simplifier.io.pvs_file import save_pvs
from simplifier.options.fields import changed
from simplifier.options.visibility import VisibilityOptions
from simplifier.pools import pool_named
from simplifier.production.viewing import save_scene_for_viewing
from simplifier.progress import Cancel, TellCount
from simplifier.visibility.find import Found, Watch, find_pvs
from simplifier.visibility.report import pvs_report
from simplifier.visibility.scene_input import is_elevation, read_input


@dataclass(frozen=True, eq=False)
class VisibleSets:
    """What may be seen from each view cell of a scene.

    ``warnings``  what the user should know of the scene and of the sets, a sentence each.
    """

    upright: UprightScene
    found: Found
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<VisibleSets: {self.pvs}>"

    @property
    def pvs(self) -> Pvs:
        return self.found.pvs

    def report(self) -> dict[str, Any]:
        """What ``occluder pvs --report`` writes."""
        return pvs_report(self.found)

    def save(self, path: str | Path) -> None:
        """Write the ``.pvs`` file; raises :class:`~simplifier.errors.OutputError`."""
        save_pvs(self.pvs, path)

    def cells_picture(self, name: str) -> bytes:
        """A PNG of all cells by the size of their sets, over the objects; ``name`` is its title."""
        # Imported here: matplotlib takes long to load.
        from simplifier.visibility.pictures.pictures import cells_picture

        return cells_picture(self.pvs, name, self.upright)

    def set_sizes(self) -> NDArray[np.int64]:
        """(c,) objects in the set of each cell; -1 of one that is not computed."""
        from simplifier.visibility.pictures.pictures import set_sizes

        return set_sizes(self.pvs)

    def save_for_viewing(self, path: str | Path) -> NDArray[np.int64]:
        """As :func:`~simplifier.production.viewing.save_scene_for_viewing` does."""
        return save_scene_for_viewing(self.upright.scene, path)


def find_visible_sets(
    path: str | Path,
    options: VisibilityOptions | None = None,
    *,
    allow_external: bool = True,
    tell_objects: TellCount = lambda done, total: None,
    tell: TellCount = lambda done, total: None,
    cancel: Cancel | None = None,
    pool: str | None = None,
    **changes: Any,
) -> VisibleSets:
    """Find what may be seen from each view cell of a scene: a file, a folder or an elevation model.

    ``options``  as :class:`VisibilityOptions` says, or its fields as ``changes``.
    ``allow_external``  whether a file may refer to others.
    ``tell_objects``, ``tell``  called with how many objects are read, 0 once the file is in memory,
                 then how many cells are done, and of how many.
    ``cancel``   once set, ends the call soon: cells that are left count as seeing everything;
                 without any that is done :class:`~simplifier.errors.CancelledError` is raised.
    ``pool``     "ray" spreads the work over the nodes of a Ray cluster.

    An elevation model has z up, whatever the options say.  The same file and options give the same
    sets as ``occluder pvs``.  Raises :class:`OccluderError`, and
    :class:`~simplifier.errors.MemoryLimitError` before any work that would need more than
    ``options.memory_limit``.
    """
    place = as_path("path", path)
    check_flag("allow external", allow_external)
    check_callable("tell objects", tell_objects)
    check_callable("tell", tell)
    check_cancel(cancel)
    chosen = changed(VisibilityOptions, options, changes)
    if is_elevation(place):
        chosen = replace(chosen, up="z")
    given = read_input(
        place, chosen.transparent, chosen, chosen.memory_limit, allow_external=allow_external
    )
    tell_objects(0, len(given.scene))
    asked = given.with_cells(chosen.cells, chosen)
    with pool_named(pool) as shared:
        found = find_pvs(
            asked.upright, asked.cells, asked.options, None,
            Watch(tell=tell, tell_objects=tell_objects, cancel=cancel),
            opaque=asked.opaque, terrain=asked.terrain, pool=shared,
        )  # fmt: skip
    return VisibleSets(asked.upright, found, (*given.scene.warnings, *found.warnings))
