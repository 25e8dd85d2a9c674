"""A picture that faces are counted into: the drawing side of the stencil slicer.

An OpenGL context without a window, and the stencil calls that moderngl does not have.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import c_int, c_uint
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.device.opengl_context import open_context, unavailable
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.section import ImageFrame
from simplifier.geometry.solid import BoolArray

_FACES_VERTEX = """
#version 330
uniform mat3 axes;
uniform vec2 corner;
uniform vec2 size;
in vec3 position;
out float depth;
flat out float anchor;
void main() {
    vec3 seen = position * axes;
    depth = seen.z;
    anchor = seen.z;
    gl_Position = vec4((seen.xy - corner) / size * 2.0 - 1.0, 0.0, 1.0);
}
"""

# The depth slope of a face seen edge-on is useless.  Held within reach of one of the face's
# corners, the fragment still falls into exactly one of the slabs that the face is drawn for.
_FACES_FRAGMENT = """
#version 330
uniform float reach;
uniform vec2 slab;
in float depth;
flat in float anchor;
void main() {
    float held = clamp(depth, anchor - reach, anchor + reach);
    if (held < slab.x || held >= slab.y) discard;
}
"""

# One triangle that covers the whole picture.
_EVERYWHERE_VERTEX = """
#version 330
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""

_EVERYWHERE_FRAGMENT = """
#version 330
void main() {}
"""


class StencilBuffer:
    """Counts faces into a stencil buffer: +1 for a back face, -1 for a front face.

    ``points`` (n, 3): the vertices of all faces; rounded to float32.  ``most_faces``: the most
    faces that :meth:`begin` will be given.

    As a context manager it makes its OpenGL context current; all methods but :meth:`close` must be
    called inside.  Afterwards no OpenGL context is current on the thread.
    """

    def __init__(self, points: FloatArray, most_faces: int) -> None:
        self._context, self._stencil = open_stencil()
        self._queries: list[Any] = []
        self._framebuffer: Any = None
        self._rows, self._columns = 0, 0
        with self:
            context = self._context
            # Looking along +d with u to the right and v upwards mirrors the picture.
            context.front_face = "cw"
            self._view = context.program(_FACES_VERTEX, _FACES_FRAGMENT)
            self._corners = context.buffer(reserve=max(most_faces, 1) * 3 * 4)
            vertices = context.buffer(points.astype(np.float32).tobytes() or bytes(12))
            self._faces = context.vertex_array(
                self._view, [(vertices, "3f", "position")], index_buffer=self._corners
            )
            self._everywhere = context.vertex_array(
                context.program(_EVERYWHERE_VERTEX, _EVERYWHERE_FRAGMENT), []
            )

    def __enter__(self) -> StencilBuffer:
        self._context.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._context.__exit__(kind, error, trace)

    def close(self) -> None:
        """Destroy the context and with it all that lives there; closing twice does no harm."""
        self._context.release()

    def reserve(self, rows: int, columns: int) -> None:
        """Make room for pictures of up to that size."""
        if self._framebuffer is not None and rows <= self._rows and columns <= self._columns:
            return
        self._rows, self._columns = max(rows, self._rows), max(columns, self._columns)
        if self._framebuffer is not None:
            self._framebuffer.release()
        placeholder = self._context.depth_renderbuffer((self._columns, self._rows))
        self._framebuffer = self._context.framebuffer(depth_attachment=placeholder)
        self._framebuffer.use()
        self._stencil.attach(self._rows, self._columns)

    def begin(self, frame: ImageFrame, centre: FloatArray, reach: float, faces: IntArray) -> None:
        """Clear the picture and look through ``frame`` at ``faces`` (m, 3) int32.

        ``centre`` (2,): where the frame sees the origin of the points.  ``reach``: no point of a
        face is further than this from the face's last corner, measured along d.
        """
        self._framebuffer.use()
        self._framebuffer.viewport = (0, 0, frame.columns, frame.rows)
        self._picture = (frame.rows, frame.columns)
        self._view["axes"].write(frame.axes.astype(np.float32).tobytes())
        self._view["corner"] = tuple(frame.corner - centre)
        self._view["size"] = (frame.columns * frame.pixel, frame.rows * frame.pixel)
        self._view["reach"] = reach
        self._corners.write(faces.tobytes())
        self._stencil.clear()

    def draw(self, first: int, last: int, near: float, far: float) -> None:
        """Count faces ``first`` to ``last`` (exclusive) where ``near`` <= depth < ``far``."""
        if last > first:
            self._stencil.count_faces()
            self._view["slab"] = (near, far)
            self._faces.render(vertices=3 * (last - first), first=3 * first)

    def start_count(self, slot: int) -> Callable[[], int]:
        """Begin to count the pixels that are not 0; the returned function waits for the number.

        A count must be fetched before its ``slot`` (0, 1, ...) is used again.
        """
        if slot == len(self._queries):
            self._queries.append(self._context.query(samples=True))
        query = self._queries[slot]
        self._stencil.select_nonzero()
        with query:
            self._everywhere.render(vertices=3)
        return lambda: int(query.samples)

    def read(self) -> BoolArray:
        """(rows, columns) bool: the pixels that are not 0; row 0 is the lowest along v."""
        return np.asarray(self._stencil.read(*self._picture) != 0)


_STENCIL_TEST, _STENCIL_BUFFER_BIT = 0x0B90, 0x0400
_STENCIL_INDEX, _UNSIGNED_BYTE, _PACK_ALIGNMENT = 0x1901, 0x1401, 0x0D05
_DEPTH_COMPONENT, _FLOAT = 0x1902, 0x1406
_FRONT, _BACK, _FRONT_AND_BACK = 0x0404, 0x0405, 0x0408
_KEEP, _ADD_WRAPPING, _SUBTRACT_WRAPPING = 0x1E00, 0x8507, 0x8508
_REPLACE, _GREATER = 0x1E01, 0x0204
_ALWAYS, _EQUAL, _NOT_EQUAL, _ALL_BITS = 0x0207, 0x0202, 0x0205, 0xFF
_FRAMEBUFFER, _RENDERBUFFER, _FRAMEBUFFER_COMPLETE = 0x8D40, 0x8D41, 0x8CD5
_DEPTH24_STENCIL8, _DEPTH_STENCIL_ATTACHMENT = 0x88F0, 0x821A

_ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "glEnable": (c_uint,),
    "glClear": (c_uint,),
    "glStencilFunc": (c_uint, c_int, c_uint),
    "glStencilOpSeparate": (c_uint, c_uint, c_uint, c_uint),
    "glDepthMask": (ctypes.c_ubyte,),
    "glDepthFunc": (c_uint,),
    "glPixelStorei": (c_uint, c_int),
    "glReadPixels": (c_int, c_int, c_int, c_int, c_uint, c_uint, ctypes.c_void_p),
    "glGenRenderbuffers": (c_int, ctypes.POINTER(c_uint)),
    "glDeleteRenderbuffers": (c_int, ctypes.POINTER(c_uint)),
    "glBindRenderbuffer": (c_uint, c_uint),
    "glRenderbufferStorage": (c_uint, c_uint, c_int, c_int),
    "glFramebufferRenderbuffer": (c_uint, c_uint, c_uint, c_uint),
    "glCheckFramebufferStatus": (c_uint,),
}


def open_stencil(
    where: str = "slicer gl", instead: str = "the cpu slicer"
) -> tuple[Any, StencilCalls]:
    """A moderngl context that is current, OpenGL 3.3 or newer, and its stencil calls.

    Raises :class:`~simplifier.errors.BackendUnavailableError` as
    :func:`~simplifier.device.opengl_context.open_context` does.
    """
    context, native = open_context(where, instead)
    return context, StencilCalls(native, where, instead)


class StencilCalls:
    """Stencil state of the current OpenGL context, by ctypes.

    ``native`` is the glcontext object, which knows the addresses of the OpenGL functions.
    """

    def __init__(self, native: Any, where: str, instead: str) -> None:
        self._where, self._instead = where, instead
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
            what = f"no stencil buffer of {columns} x {rows} pixels"
            raise unavailable(what, self._where, self._instead)

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

    def raise_depth(self) -> None:
        """From now on fragments with a greater depth are drawn, all over."""
        self._call["glStencilFunc"](_ALWAYS, 0, _ALL_BITS)
        self._call["glStencilOpSeparate"](_FRONT_AND_BACK, _KEEP, _KEEP, _KEEP)
        self._call["glDepthFunc"](_GREATER)
        self._call["glDepthMask"](1)

    def mark_greater(self) -> None:
        """From now on fragments with a greater depth set the stencil to 1, and draw nothing."""
        self._call["glStencilFunc"](_ALWAYS, 1, _ALL_BITS)
        self._call["glStencilOpSeparate"](_FRONT_AND_BACK, _KEEP, _KEEP, _REPLACE)
        self._call["glDepthFunc"](_GREATER)
        self._call["glDepthMask"](0)

    def select_zero(self, *, greater: bool) -> None:
        """From now on only fragments where the stencil is 0 are drawn: all, or the greater ones."""
        self._call["glStencilFunc"](_EQUAL, 0, _ALL_BITS)
        self._call["glStencilOpSeparate"](_FRONT_AND_BACK, _KEEP, _KEEP, _KEEP)
        self._call["glDepthFunc"](_GREATER if greater else _ALWAYS)
        self._call["glDepthMask"](1)

    def read(self, rows: int, columns: int) -> NDArray[np.uint8]:
        """(rows, columns) uint8: the stencil from its lowest row up; waits for the drawing."""
        values = np.empty((rows, columns), dtype=np.uint8)
        self._call["glReadPixels"](
            0, 0, columns, rows, _STENCIL_INDEX, _UNSIGNED_BYTE, values.ctypes.data
        )
        return values

    def read_depth(self, rows: int, columns: int) -> NDArray[np.float32]:
        """(rows, columns) float32: the depths, 0 to 1, from the lowest row up."""
        values = np.empty((rows, columns), dtype=np.float32)
        self._call["glReadPixels"](
            0, 0, columns, rows, _DEPTH_COMPONENT, _FLOAT, values.ctypes.data
        )
        return values
