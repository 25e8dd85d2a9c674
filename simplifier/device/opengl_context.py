"""An OpenGL context without a window, by EGL."""

from __future__ import annotations

from typing import Any

from simplifier.errors import BackendUnavailableError


def open_context(where: str, instead: str, version: int = 330) -> tuple[Any, Any]:
    """A moderngl context that is current, of an OpenGL ``version`` (330 is 3.3) or newer, and the
    glcontext object below it, which knows the addresses of the OpenGL functions.

    Raises :class:`BackendUnavailableError` where a package or a library is missing, which says
    ``where`` it is wanted, and what can be used ``instead``.
    """
    try:
        import glcontext
        import moderngl
    except ImportError as error:
        what = f"the Python package {error.name} is missing"
        raise unavailable(what, where, instead) from error
    # Both packages raise plain Exception, for a missing library as for a refusing driver.
    try:
        native = glcontext.get_backend_by_name("egl")(mode="standalone", glversion=version)
        context = moderngl.create_context(context=native)
    except Exception as error:
        number = f"{version // 100}.{version // 10 % 10}"
        what = f"OpenGL {number} with EGL cannot be opened ({error})"
        raise unavailable(what, where, instead) from error
    return context, native


def unavailable(what: str, where: str, instead: str) -> BackendUnavailableError:
    """What is missing, ``where`` it is wanted, what to install, and what to use ``instead``."""
    return BackendUnavailableError(
        what,
        where=where,
        remedy="install the 'gl' extra (pip install planar-occluder[gl]) and OpenGL with EGL "
        "(Debian packages libegl1 libegl-mesa0 libgl1-mesa-dri libgles2 libgl1 libopengl0 "
        f"libgbm1), or use {instead}",
    )
