"""The environment of worker processes: what they need of the server's, and nothing else.

They read files from anyone.  What the server was told by its environment, such as passwords of
databases and keys of clouds, is no business of theirs; so the names that pass are listed.
"""

from __future__ import annotations

from collections.abc import Mapping

_PASSED = {
    # Programs, libraries and folders of whoever runs the service.
    "PATH", "HOME", "USER", "LOGNAME", "TMPDIR", "TEMP", "TMP", "XDG_CACHE_HOME",
    "XDG_CONFIG_HOME", "LD_LIBRARY_PATH", "LD_PRELOAD", "DYLD_LIBRARY_PATH",
    "DYLD_FALLBACK_LIBRARY_PATH", "GLIBC_TUNABLES",
    # Language and time.
    "LANG", "LANGUAGE", "TZ", "TZDIR",
    # The interpreter.
    "PYTHONDEVMODE", "PYTHONDONTWRITEBYTECODE", "PYTHONFAULTHANDLER", "PYTHONHASHSEED",
    "PYTHONHOME", "PYTHONMALLOC", "PYTHONPYCACHEPREFIX", "PYTHONUNBUFFERED", "PYTHONUTF8",
    "PYTHONWARNINGS",
    # Pictures.
    "MPLCONFIGDIR", "FONTCONFIG_FILE", "FONTCONFIG_PATH",
    # Ours.
    "OCCLUDER_LOG", "OCCLUDER_THREADS",
}  # fmt: skip

_PASSED_FAMILIES = (
    "LC_", "MALLOC_", "NUMBA_",
    # OpenGL, which may cut the sections.
    "EGL_", "__EGL_", "__GLX_", "LIBGL_", "MESA_", "GALLIUM_",
)  # fmt: skip

_SET = {
    # Threads are the library's own; those of others would only take memory and each other's time.
    "OPENCV_FOR_THREADS_NUM": "1",
    # Each further arena keeps what its threads have freed.
    "MALLOC_ARENA_MAX": "2",
    "MPLBACKEND": "agg",
}


def worker_environment(own: Mapping[str, str], import_path: str) -> dict[str, str]:
    """What a worker process is given of the server's ``own`` environment.

    ``import_path`` is where it finds modules.
    """
    # Not above: nothing that a server imports needs the library.
    from simplifier.matrix_threads import ONE_THREAD

    passed = {
        name: value
        for name, value in own.items()
        if name in _PASSED or name.startswith(_PASSED_FAMILIES)
    }
    return {**passed, **ONE_THREAD, **_SET, "PYTHONPATH": import_path}
