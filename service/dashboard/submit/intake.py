"""What each form of the submit page takes in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from service.jobs.job import OVERRIDES_FILE, JobKind
from service.routes.submit import PARTS

COMMON: Mapping[JobKind, tuple[str, ...]] = {
    JobKind.OCCLUDER: (
        "budget", "preset", "ground", "up", "viewers", "resolution", "error_bound", "lods",
    ),
    JobKind.VISIBILITY: (
        "method", "cells", "cell_size", "eye_height", "epsilon", "up", "ground", "slices",
    ),
}  # fmt: skip
"""Settings that most people need, in this order."""


@dataclass(frozen=True)
class Intake:
    """A form for files of a kind.

    ``place``    of its page; ``name`` in the choice between them.
    ``address``  that the files are sent to.
    ``title``    of the files, ``one`` of them in a sentence.
    ``advice``   on files, after the formats.
    ``assets``   whether what comes of them is a run of an asset.
    """

    kind: JobKind
    place: str
    name: str
    address: str
    title: str
    one: str
    advice: str
    assets: bool

    @property
    def suffixes(self) -> list[str]:
        """Of the formats, with their dots, in alphabetical order."""
        return sorted(PARTS[self.kind][0].suffixes)

    @property
    def overrides(self) -> bool:
        """Whether files of overrides go along."""
        return any(f"input/{part.name}.toml" == OVERRIDES_FILE for part in PARTS[self.kind])


MESHES = Intake(
    JobKind.OCCLUDER, "/submit", "Occluders", "/v1/occluders", "Meshes", "a mesh",
    "castle.overrides.toml is sent along with castle.glb.", assets=True,
)  # fmt: skip
SCENES = Intake(
    JobKind.VISIBILITY, "/submit/visibility", "Visible sets", "/v1/visibility", "Scenes",
    "a scene", "A zip holds a folder with a scene; npy and tif are elevation models.", assets=False,
)  # fmt: skip
INTAKES = (MESHES, SCENES)
