"""Every refusal of this library, as one tree.

    OccluderError
    |-- MeshError                  the input cannot be used
    |   |-- UnreadableMeshError    the file is missing, damaged, or not what its suffix says
    |   |-- UnknownFormatError     no codec for the suffix
    |   `-- EmptyMeshError         no triangle is left
    |-- SceneError                 a built scene is missing, damaged, or of another scene
    |-- UnreadablePathError        a camera path is missing, damaged or not as its schema says
    |-- TomlError                  a TOML file is missing or damaged
    |-- OverridesError             a file of overrides is damaged or not of this mesh
    |-- OptionError                an option is unknown or out of range (exit status 2)
    |-- BackendUnavailableError    a backend was asked for that this machine cannot run
    |-- OutputError                the result cannot be written
    |-- CommandError               a command from another package cannot be loaded
    `-- CancelledError             the caller asked to stop

A message says what is wrong, where, and what to do about it.  It is raised once, where the fault is
found, and turned into an exit status (``cli_failures.py``) or an HTTP answer in one place.
"""

from __future__ import annotations


class OccluderError(Exception):
    """What went wrong, where, and what to do.

    ``what`` and ``remedy`` are sentences without a full stop; ``where`` is a file, an option or a
    stage and may be empty.
    """

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        place = f"{where}: " if where else ""
        advice = f"; {remedy}" if remedy else ""
        super().__init__(f"{place}{what}{advice}")


class MeshError(OccluderError):
    """The input mesh cannot be used."""


class UnreadableMeshError(MeshError):
    """The file is missing, damaged, truncated, or not what its suffix says."""


class UnknownFormatError(MeshError):
    """No codec is registered for the file's suffix."""


class EmptyMeshError(MeshError):
    """No triangle is left after the unusable ones were dropped."""


class SceneError(OccluderError):
    """The occluders of a scene are missing, damaged, or those of another scene."""


class UnreadablePathError(OccluderError):
    """A camera path is missing, damaged or not as its schema says."""


class TomlError(OccluderError):
    """A TOML file is missing, damaged, or no TOML."""


class OverridesError(OccluderError):
    """Overrides are missing, damaged, say what cannot be, or name what the mesh does not have."""


class OptionError(OccluderError):
    """An option is unknown or its value is out of range."""


class BackendUnavailableError(OccluderError):
    """A backend was asked for that this machine cannot run."""


class OutputError(OccluderError):
    """The result cannot be written."""


class CommandError(OccluderError):
    """A command from another package cannot be loaded."""


class CancelledError(OccluderError):
    """The caller asked to stop."""
