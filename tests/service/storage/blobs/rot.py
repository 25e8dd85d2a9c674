"""Bytes that change on the disk, as bad memory, bad cables and old disks change them."""

from __future__ import annotations

import os
from pathlib import Path


def flip(path: Path, at: int = -1) -> None:
    """Change one bit of a file; its size and all else that the system notes of it are as before."""
    before, mode = path.stat(), path.stat().st_mode
    path.chmod(0o600)
    data = bytearray(path.read_bytes())
    data[at] ^= 0x10
    with path.open("r+b") as file:
        file.write(data)
    path.chmod(mode & 0o777)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
