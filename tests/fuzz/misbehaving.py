"""A target that does on demand what a broken reader may do."""

from __future__ import annotations

import os
import time
from pathlib import Path

from simplifier.errors import UnreadableMeshError
from tests.fuzz.targets import Target


def _misbehave(data: bytes, folder: Path) -> None:
    match data:
        case b"hang":
            time.sleep(600.0)
        case b"die":
            os.abort()
        case b"leave":
            os._exit(3)
        case b"eat":
            bytearray(1 << 42)
        case b"break":
            raise AssertionError("17.5 voxels out")
        case b"refuse":
            raise UnreadableMeshError("the file is damaged")
        case b"ramble":
            raise UnreadableMeshError("damaged", remedy="word " * 500)


def misbehaving(name: str) -> Target:
    """Under any name."""
    return Target(name, _misbehave, seconds=1.0)
