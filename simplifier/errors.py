"""Every refusal of this library, as one tree.

    OccluderError
    |-- MeshError                  the input cannot be used
    |   |-- UnreadableMeshError    the file is missing, damaged, or not what its suffix says
    |   |-- UnknownFormatError     no codec for the suffix
    |   `-- EmptyMeshError         no triangle is left
    |-- SceneError                 a built scene is missing, damaged, or of another scene
    |-- UnreadablePathError        a camera path is missing, damaged or not as its schema says
    |-- UnreadablePvsError         a file of visible sets is missing, damaged or not known
    |-- TomlError                  a TOML file is missing or damaged
    |-- OverridesError             a file of overrides is damaged or not of this mesh
    |-- ManifestError              a build's manifest or record cannot be used
    |-- OptionError                an option is unknown or out of range, or an argument is of
    |                              another kind (exit status 2)
    |-- MemoryLimitError           the run would need more memory than it may use
    |-- BackendUnavailableError    a backend was asked for that this machine cannot run
    |-- OutputError                the result cannot be written
    |-- CommandError               a command from another package cannot be loaded
    `-- CancelledError             the caller asked to stop

A message says what is wrong, where, and what to do about it.  It is raised once, where the fault is
found, and turned into an exit status (``cli_failures.py``) or an HTTP answer in one place.
"""

from __future__ import annotations

from typing import ClassVar

_LONGEST = 500  # letters of what is wrong: values of damaged files know no end


def printable(text: str) -> str:
    """One line that any terminal, log or JSON can show: what cannot be printed is escaped.

    Names from damaged files hold control characters, which a terminal obeys, and half characters,
    which no encoding writes.
    """
    if text.isprintable():
        return text
    return "".join(
        one if one.isprintable() else one.encode("unicode_escape").decode("ascii") for one in text
    )


class OccluderError(Exception):
    """What went wrong, where, and what to do.

    ``what`` and ``remedy`` are sentences without a full stop; ``where`` is a file, an option or a
    stage and may be empty.  ``remedy`` is empty only where the caller asked for the end.  All are
    :func:`printable`.
    """

    usual_remedy: ClassVar[str] = ""
    """Of a kind of error that mostly has the same."""

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what = what = printable(what if len(what) <= _LONGEST else f"{what[:_LONGEST]}...")
        self.where = where = printable(where)
        self.remedy = printable(remedy or self.usual_remedy)
        place = f"{where}: " if where else ""
        advice = f"; {self.remedy}" if self.remedy else ""
        super().__init__(f"{place}{what}{advice}")


class MeshError(OccluderError):
    """The input mesh cannot be used."""


class UnreadableMeshError(MeshError):
    """The file is missing, damaged, truncated, or not what its suffix says."""

    usual_remedy = "copy or export it again"


class UnknownFormatError(MeshError):
    """No codec is registered for the file's suffix."""


class EmptyMeshError(MeshError):
    """No triangle is left after the unusable ones were dropped."""


class SceneError(OccluderError):
    """The occluders of a scene are missing, damaged, or those of another scene."""


class UnreadablePathError(OccluderError):
    """A camera path is missing, damaged or not as its schema says."""


class UnreadablePvsError(OccluderError):
    """A file of potentially visible sets is missing, damaged, or of a version that is not known."""


class TomlError(OccluderError):
    """A TOML file is missing, damaged, or no TOML."""


class OverridesError(OccluderError):
    """Overrides are missing, damaged, say what cannot be, or name what the mesh does not have."""


class ManifestError(OccluderError):
    """The manifest of a build, or the record of what it made, cannot be used."""


class OptionError(OccluderError):
    """An option is unknown or out of range, or an argument is not of the kind that is asked for."""


class MemoryLimitError(OccluderError):
    """The run would need more memory than it may use; nothing of it was begun.

    ``resolution``  the finest that would fit, 0 where none does or it has no part in it.
    """

    def __init__(
        self, what: str, *, where: str = "", remedy: str = "", resolution: int = 0
    ) -> None:
        super().__init__(what, where=where, remedy=remedy)
        self.resolution = resolution


class BackendUnavailableError(OccluderError):
    """A backend was asked for that this machine cannot run."""


class OutputError(OccluderError):
    """The result cannot be written."""


class CommandError(OccluderError):
    """A command from another package cannot be loaded."""


class CancelledError(OccluderError):
    """The caller asked to stop."""
