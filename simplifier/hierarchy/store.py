"""Occluders kept in files under the hash of what they were made from."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from simplifier.errors import MeshError, UnreadableMeshError
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.node import hiding_radius
from simplifier.hierarchy.node_plan import is_key
from simplifier.io.files import read_bytes, remove_drafts
from simplifier.io.load import decode_occluder
from simplifier.io.save import save_occluder


@dataclass(frozen=True)
class Summary:
    """What a tree has to know of an occluder without reading it.

    ``triangles``    0 where it would hide nothing.
    ``error_bound``  proved, in the occluder's own space.
    ``radius``       see :func:`~simplifier.hierarchy.node.hiding_radius`.
    ``checksum``     CRC-32 of the occluder's file.
    """

    triangles: int
    error_bound: float
    radius: float
    checksum: int


@dataclass(frozen=True)
class OccluderStore:
    """A folder of ``<key>.glb``; each appears whole or not at all, so a killed run leaves no half.

    A node whose occluder would hide nothing has a file without triangles, so that it is not tried
    again.  The folder has to be there to write to it.
    """

    folder: Path

    def path(self, key: str) -> Path:
        """Raises ValueError for what is no key, which might lead out of the folder."""
        if not is_key(key):
            raise ValueError(f"{key!r} is no key of an occluder")
        return self.folder / f"{key}.glb"

    def keys(self) -> set[str]:
        """All that are there, damaged ones included."""
        return {path.stem for path in self.folder.glob("*.glb") if is_key(path.stem)}

    def write(self, key: str, occluder: Occluder) -> Summary:
        """Raises :class:`~simplifier.errors.OutputError`.

        The summary is of what can be read back, which is rounded: it must not depend on which run
        made the file.
        """
        save_occluder(occluder, self.path(key))
        return self.summary(key)

    def read(self, key: str, checksum: int | None = None) -> Occluder:
        """Raises :class:`~simplifier.errors.MeshError` where it is missing or damaged.

        ``checksum``  CRC-32 that the file has to have, if that is known.
        """
        path = self.path(key)
        data = read_bytes(path)
        if checksum is not None and zlib.crc32(data) != checksum:
            raise UnreadableMeshError("it is not what was written", where=str(path))
        occluder = decode_occluder(data, path)  # its own file, so the suffix is not in doubt
        if not 0.0 <= occluder.error_bound < math.inf:
            raise UnreadableMeshError(
                "it does not say how far it may stray",
                where=str(path),
                remedy="build the scene again",
            )
        return occluder

    def summary(self, key: str) -> Summary:
        """Raises as :meth:`read`."""
        occluder = self.read(key)
        radius = hiding_radius(occluder)
        return Summary(len(occluder.faces), occluder.error_bound, radius, self.checksum(key))

    def checksum(self, key: str) -> int:
        """CRC-32 of the file's bytes.  Raises as :meth:`read`."""
        return zlib.crc32(read_bytes(self.path(key)))

    def kept(self, key: str, known: Summary | None = None) -> Summary | None:
        """The summary of a file that is as it was written; None where it has to be made again.

        ``known`` spares reading the occluder, and tells apart a file that was changed.
        """
        try:
            if known is None:
                return self.summary(key)
            return known if self.checksum(key) == known.checksum else None
        except MeshError:
            return None

    def keep_only(self, keys: Iterable[str]) -> None:
        """Delete what no scene refers to any more, and what killed runs left; no other files."""
        for stale in self.keys() - set(keys):
            self.path(stale).unlink(missing_ok=True)
        remove_drafts(self.folder)
