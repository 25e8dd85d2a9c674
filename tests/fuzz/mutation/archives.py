"""Changes within a ZIP archive, which is put together again so that its sums are right."""

from __future__ import annotations

import io
import zipfile
import zlib
from random import Random

from tests.fuzz.mutation.words import reword
from tests.io.builders import zipped


def reword_parts(random: Random, data: bytes, other: bytes) -> bytes:
    """One small change in the text or the name of a part; what is no archive passes."""
    parts, from_other = _parts(data), _parts(other)
    if not parts:
        return data
    name = random.choice(sorted(parts))
    if random.random() < 0.1:
        parts[reword(random, name.encode(), b"").decode("utf-8", "replace")] = parts.pop(name)
    else:
        parts[name] = reword(random, parts[name], from_other.get(name, b""))
    return zipped(dict(parts), random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))


def _parts(data: bytes) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {one.filename: archive.read(one) for one in archive.infolist()}
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        NotImplementedError,
        RuntimeError,
        ValueError,
    ):
        return {}
