"""A disk that is small enough to be filled."""

from __future__ import annotations

import subprocess
from contextlib import contextmanager, suppress

import pytest


@contextmanager
def small_disk(place, room):
    """A new folder that is a disk of ``room`` bytes; a skip where none can be mounted."""
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={room}", "occluder-test", str(place)]
    try:
        done = subprocess.run(mount, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no command 'mount'")
    if done.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)


@contextmanager
def filled(disk, left=0):
    """What is left of the disk is taken by others, to the last byte but ``left``."""
    ballast = disk / "ballast"
    with ballast.open("wb", buffering=0) as file:
        for size in (1 << 16, 1):
            with suppress(OSError):
                while True:
                    file.write(bytes(size))
        file.truncate(file.tell() - left)
    try:
        yield
    finally:
        ballast.unlink()
