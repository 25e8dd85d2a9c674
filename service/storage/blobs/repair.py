"""Putting damaged and lost blobs right from a copy of a folder of blobs, such as a backup."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from service.errors import SettingsError
from service.jobs.stores import BlobInventory, BlobState
from service.storage.blobs.identity import FolderHome
from service.storage.blobs.places import BlobPlaces


@dataclass(frozen=True)
class Backup:
    """The blobs of a copy, of which only bytes of the right digest are taken."""

    places: BlobPlaces

    @classmethod
    def of(cls, folder: Path) -> Backup:
        """A copy of the folder of blobs, or of the data folder that it is in.

        Raises :class:`~service.errors.SettingsError` where there are no blobs, and it is not that
        a server had none to store.
        """
        inner = folder / "blobs"
        places = BlobPlaces(inner if inner.is_dir() else folder)
        if FolderHome(places.folder).read_identity() is None and not any(places.digests()):
            raise SettingsError(f"'{folder}' has no blobs; name a copy of the data folder")
        return cls(places)

    def restore(self, target: BlobInventory, digest: str) -> bool:
        """Copy a blob to its place; whether the copy had it, with the right bytes.

        Raises :class:`~service.errors.ServiceError` where it cannot be stored.
        """
        try:
            file = self.places.place(digest).open("rb", buffering=0)
        except FileNotFoundError:
            return False
        with file:
            return target.restore(digest, file)


def restore_from_aside(target: BlobInventory, digest: str) -> bool:
    """Put back what was put aside if its bytes are right after all: memory or a cable was bad."""
    if target.examine_aside(digest) is not BlobState.WHOLE:
        return False
    target.put_back(digest)
    return True
