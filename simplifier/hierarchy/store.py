"""Occluders kept in files under the hash of what they were made from."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from simplifier.errors import MeshError, OutputError, UnreadableMeshError
from simplifier.geometry.occluder import Occluder
from simplifier.hierarchy.node_plan import is_key
from simplifier.hierarchy.packing import WeldedMesh
from simplifier.io.files import read_bytes, remove_drafts, write_whole
from simplifier.io.load import decode_occluder
from simplifier.io.places import names_in
from simplifier.io.save import occluder_bytes
from simplifier.selection.measure import hiding_radius

_SUFFIX = ".glb"


@dataclass(frozen=True)
class Summary:
    """What a tree has to know of an occluder without reading it.

    ``triangles``    0 where it would hide nothing.
    ``error_bound``  proved, in the occluder's own space.
    ``radius``       see :func:`~simplifier.selection.measure.hiding_radius`.
    ``checksum``     CRC-32 of the occluder's file.
    """

    triangles: int
    error_bound: float
    radius: float
    checksum: int


@dataclass(frozen=True)
class OccluderFile:
    """What the file of an occluder is to hold, and what a tree has to know of it.

    ``mesh``  its triangles for ``scene.occs``; None where they do not fit that.
    """

    data: bytes
    summary: Summary
    mesh: WeldedMesh | None

    @classmethod
    def of(cls, occluder: Occluder) -> OccluderFile:
        """Raises :class:`~simplifier.errors.OutputError` where the format cannot hold it.

        The summary is of what can be read back, which is rounded: it must not depend on which run
        made the file.
        """
        data = occluder_bytes(occluder, _UNNAMED)
        found = _decoded(data, _UNNAMED)
        mesh = None
        with suppress(OutputError):
            mesh = WeldedMesh.of(found)
        return cls(data, _summary(found, data), mesh)


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
            raise ValueError(f"{key!r} is not a key of an occluder")
        return self.folder / f"{key}{_SUFFIX}"

    def keys(self) -> set[str]:
        """All that are there, damaged ones included."""
        names = (name for name in names_in(self.folder) if name.endswith(_SUFFIX))
        return {key for name in names if is_key(key := name.removesuffix(_SUFFIX))}

    def write(self, key: str, file: OccluderFile) -> Summary:
        """Raises :class:`~simplifier.errors.OutputError`."""
        write_whole(self.path(key), file.data)
        return file.summary

    def read(self, key: str, checksum: int | None = None) -> Occluder:
        """Raises :class:`~simplifier.errors.MeshError` where it is missing or damaged.

        ``checksum``  CRC-32 that the file has to have, if that is known.
        """
        path = self.path(key)
        data = read_bytes(path)
        if checksum is not None and zlib.crc32(data) != checksum:
            raise UnreadableMeshError("it is not what was written", where=str(path))
        return _decoded(data, path)

    def summary(self, key: str) -> Summary:
        """Raises as :meth:`read`."""
        path = self.path(key)
        data = read_bytes(path)
        return _summary(_decoded(data, path), data)

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


_UNNAMED = Path("occluder.glb")  # its own file, so the suffix is not in doubt


def _decoded(data: bytes, path: Path) -> Occluder:
    occluder = decode_occluder(data, path)
    if not 0.0 <= occluder.error_bound < math.inf:
        raise UnreadableMeshError(
            "it does not say how far it may stray",
            where=str(path),
            remedy="build the scene again",
        )
    return occluder


def _summary(occluder: Occluder, data: bytes) -> Summary:
    radius = hiding_radius(occluder)
    return Summary(len(occluder.faces), occluder.error_bound, radius, zlib.crc32(data))
