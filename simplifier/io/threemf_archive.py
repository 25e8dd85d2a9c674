"""The ZIP archive that a 3MF file is: its parts, none read before its size is known to be sane."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO, TypeVar

from simplifier.errors import UnreadableMeshError
from simplifier.io.xml_text import Attributes, walk_xml

_MOST_PARTS = 10_000
_MOST_BYTES = 4 << 30  # of all models, unpacked
_FEW_BYTES = 64 << 20  # that may be packed as well as they can
_MOST_TIMES = 200  # smaller than unpacked; meshes as text are within thirty
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ROOT = "_rels/.rels"
_MODEL = "/3dmodel"  # ends the type of the relationship that leads to the model
_USUAL = "3d/3dmodel.model"
_EXPORT = "copy or export it again"

_Read = TypeVar("_Read")


class Archive:
    """The models of an archive, by their names in lower case, as they are compared."""

    def __init__(self, file: Path | IO[bytes], where: str) -> None:
        """Reads the directory alone.  Raises :class:`UnreadableMeshError`."""
        self.where = where
        self._file = self._guarded(lambda: zipfile.ZipFile(file))
        self._parts = {one.filename.lstrip("/").lower(): one for one in self._file.infolist()}
        models = [self._parts[name] for name in self.models()]
        self.unpacked = sum(one.file_size for one in models)
        """Bytes of all models."""
        packed = sum(one.compress_size for one in models)
        if len(self._file.infolist()) > _MOST_PARTS:
            raise self._wrong(f"it has more than {_MOST_PARTS} parts", "export the model alone")
        if self.unpacked > min(_MOST_BYTES, max(_FEW_BYTES, _MOST_TIMES * packed)):
            raise self._wrong(
                f"its models would unpack from {packed} to {self.unpacked} bytes",
                "split it, if it is a model at all",
            )

    def models(self) -> list[str]:
        """Their names."""
        return [name for name in self._parts if name.endswith(".model")]

    def main_model(self) -> str:
        """The name of the model that is meant, by the relationships of the archive."""
        found: list[str] = []

        def begin(name: str, own: Attributes) -> None:
            if name == "Relationship" and own.get("Type", "").endswith(_MODEL):
                found.append(own.get("Target", "").lstrip("/").lower())

        if _ROOT in self._parts:
            self.walk(_ROOT, begin, lambda name: None)
        name = found[0] if found else _USUAL
        if name not in self._parts:
            raise self._wrong(f"there is no model '{name[:60]}' in the archive", _EXPORT)
        return name

    def walk(
        self,
        name: str,
        begin: Callable[[str, Attributes], object],
        end: Callable[[str], object],
        namespace: Callable[[str | None, str | None], object] | None = None,
    ) -> None:
        """As :func:`~simplifier.io.xml_text.walk_xml`, of a part, unpacked bit by bit."""
        with self.open(name) as part:
            self._guarded(
                lambda: walk_xml(part, f"{self.where}: {name}", begin, end, namespace=namespace)
            )

    def open(self, name: str) -> IO[bytes]:
        """A part, for :meth:`read`."""
        one = self._parts.get(name)
        if one is None:
            raise self._wrong(f"there is no part '{name[:60]}' in the archive", _EXPORT)
        if one.flag_bits & 1 or one.compress_type not in _METHODS:
            raise self._wrong(
                f"its part '{name[:60]}' is encrypted or packed in a way that 3MF does not have",
                "export it again without encryption",
            )
        return self._guarded(lambda: self._file.open(one))

    def read(self, part: IO[bytes], count: int) -> bytes:
        """So many bytes of an open part, or what is left of it."""
        return self._guarded(lambda: part.read(count))

    def _guarded(self, read: Callable[[], _Read]) -> _Read:
        """What ``read`` returns; :class:`UnreadableMeshError` where the archive is damaged."""
        try:
            return read()
        except (
            zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError,
        ) as error:  # fmt: skip
            reason = str(error).splitlines()[0][:100] if str(error) else "it ends too early"
            raise self._wrong(f"the archive is damaged or cut off ({reason})", _EXPORT) from None

    def _wrong(self, what: str, remedy: str) -> UnreadableMeshError:
        return UnreadableMeshError(what, where=self.where, remedy=remedy)
