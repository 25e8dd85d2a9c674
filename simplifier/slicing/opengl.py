"""An OpenGL context without a window, and the stencil calls that moderngl does not have."""

from __future__ import annotations

import ctypes
from ctypes import c_int, c_uint
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import BackendUnavailableError

_STENCIL_TEST, _STENCIL_BUFFER_BIT = 0x0B90, 0x0400
_STENCIL_INDEX, _UNSIGNED_BYTE, _PACK_ALIGNMENT = 0x1901, 0x1401, 0x0D05
_FRONT, _BACK, _FRONT_AND_BACK = 0x0404, 0x0405, 0x0408
_KEEP, _ADD_WRAPPING, _SUBTRACT_WRAPPING = 0x1E00, 0x8507, 0x8508
_ALWAYS, _NOT_EQUAL, _ALL_BITS = 0x0207, 0x0205, 0xFF
_FRAMEBUFFER, _RENDERBUFFER, _FRAMEBUFFER_COMPLETE = 0x8D40, 0x8D41, 0x8CD5
_DEPTH24_STENCIL8, _DEPTH_STENCIL_ATTACHMENT = 0x88F0, 0x821A

_ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "glEnable": (c_uint,),
    "glClear": (c_uint,),
    "glStencilFunc": (c_uint, c_int, c_uint),
    "glStencilOpSeparate": (c_uint, c_uint, c_uint, c_uint),
    "glPixelStorei": (c_uint, c_int),
    "glReadPixels": (c_int, c_int, c_int, c_int, c_uint, c_uint, ctypes.c_void_p),
    "glGenRenderbuffers": (c_int, ctypes.POINTER(c_uint)),
    "glDeleteRenderbuffers": (c_int, ctypes.POINTER(c_uint)),
    "glBindRenderbuffer": (c_uint, c_uint),
    "glRenderbufferStorage": (c_uint, c_uint, c_int, c_int),
    "glFramebufferRenderbuffer": (c_uint, c_uint, c_uint, c_uint),
    "glCheckFramebufferStatus": (c_uint,),
}


def open_context() -> tuple[Any, StencilCalls]:
    """A moderngl context that is current, OpenGL 3.3 or newer, and its stencil calls.

    Raises :class:`BackendUnavailableError` where a package or a library is missing.
    """
    try:
        import glcontext
        import moderngl
    except ImportError as error:
        raise _unavailable(f"the Python package {error.name} is missing") from error
    # Both packages raise plain Exception, for a missing library as for a refusing driver.
    try:
        native = glcontext.get_backend_by_name("egl")(mode="standalone", glversion=330)
        context = moderngl.create_context(context=native)
    except Exception as error:
        raise _unavailable(f"OpenGL 3.3 with EGL cannot be opened ({error})") from error
    return context, StencilCalls(native)


def _unavailable(what: str) -> BackendUnavailableError:
    return BackendUnavailableError(
        what,
        where="slicer gl",
        remedy="install the 'gl' extra (pip install planar-occluder[gl]) and OpenGL with EGL "
        "(Debian packages libegl1 libegl-mesa0 libgl1-mesa-dri libgles2 libgl1 libopengl0 "
        "libgbm1), or use the cpu slicer",
    )


class StencilCalls:
    """Stencil state of the current OpenGL context, by ctypes.

    ``native`` is the glcontext object, which knows the addresses of the OpenGL functions.
    """

    def __init__(self, native: Any) -> None:
        # Every result type is an unsigned int; functions without a result leave it unread.
        self._call = {
            name: ctypes.CFUNCTYPE(c_uint, *arguments)(native.load(name))
            for name, arguments in _ARGUMENTS.items()
        }
        self._renderbuffer = c_uint(0)
        self._call["glEnable"](_STENCIL_TEST)
        self._call["glPixelStorei"](_PACK_ALIGNMENT, 1)

    def attach(self, rows: int, columns: int) -> None:
        """Give the bound framebuffer a stencil of that size; an earlier one is freed."""
        call, fresh = self._call, c_uint(0)
        call["glDeleteRenderbuffers"](1, ctypes.byref(self._renderbuffer))
        call["glGenRenderbuffers"](1, ctypes.byref(fresh))
        call["glBindRenderbuffer"](_RENDERBUFFER, fresh)
        call["glRenderbufferStorage"](_RENDERBUFFER, _DEPTH24_STENCIL8, columns, rows)
        call["glFramebufferRenderbuffer"](
            _FRAMEBUFFER, _DEPTH_STENCIL_ATTACHMENT, _RENDERBUFFER, fresh
        )
        self._renderbuffer = fresh
        if call["glCheckFramebufferStatus"](_FRAMEBUFFER) != _FRAMEBUFFER_COMPLETE:
            raise _unavailable(f"no stencil buffer of {columns} x {rows} pixels")

    def clear(self) -> None:
        """Set all of the stencil to 0."""
        self._call["glClear"](_STENCIL_BUFFER_BIT)

    def count_faces(self) -> None:
        """From now on every drawn fragment counts: back faces +1, front faces -1, modulo 256."""
        self._call["glStencilFunc"](_ALWAYS, 0, _ALL_BITS)
        self._call["glStencilOpSeparate"](_FRONT, _KEEP, _KEEP, _SUBTRACT_WRAPPING)
        self._call["glStencilOpSeparate"](_BACK, _KEEP, _KEEP, _ADD_WRAPPING)

    def select_nonzero(self) -> None:
        """From now on only fragments where the stencil is not 0 are drawn, and leave it alone."""
        self._call["glStencilFunc"](_NOT_EQUAL, 0, _ALL_BITS)
        self._call["glStencilOpSeparate"](_FRONT_AND_BACK, _KEEP, _KEEP, _KEEP)

    def read(self, rows: int, columns: int) -> NDArray[np.uint8]:
        """(rows, columns) uint8: the stencil from its lowest row up; waits for the drawing."""
        values = np.empty((rows, columns), dtype=np.uint8)
        self._call["glReadPixels"](
            0, 0, columns, rows, _STENCIL_INDEX, _UNSIGNED_BYTE, values.ctypes.data
        )
        return values
