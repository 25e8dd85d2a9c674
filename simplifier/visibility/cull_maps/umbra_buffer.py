"""Shadows that are drawn into a depth buffer: the drawing side of the OpenGL cull maps.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000), section
5: the union of the shadows of a sample is what the depth test keeps.  The intersection over the
samples takes two passes each.  The first marks the pixels where a shadow is higher than what was
found before, and so right already; the second draws the shadows anew into all others.

Depth 0 to 1 stands for heights from low to high, so that the greater depth is the higher shadow.
The rasterizer only proposes pixels.  Whether a shadow falls on a pixel's centre, and how high it is
there, the fragment shader finds by itself from whole numbers, so that nothing depends on how a
driver snaps corners, clips edges or interpolates.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.slicing.stencil_buffer import open_stencil
from simplifier.visibility.cull_maps.shadow_edges import ShadowEdges

PRECISION = 2.0**-18
"""Of the range of heights: what a height is lower than it should be at most, the eye being in it.

Each operation of the shaders is off by 2^-24 at most, as the buffer of 24 bits is, and 2^-20 of
what was computed with is taken off in the end: a shadow is never too high.
"""

_EVERYWHERE_VERTEX = """
#version 330
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, -1.0, 1.0);
}
"""

_NOTHING_FRAGMENT = """
#version 330
void main() {}
"""

# What is in a column up to the height of its occluder is hidden as well.
_COLUMNS_FRAGMENT = """
#version 330
uniform sampler2D heights;
void main() {
    float height = texelFetch(heights, ivec2(gl_FragCoord.xy), 0).r;
    gl_FragDepth = clamp(height - 0x1p-20 * 2.0, 0.0, 1.0);
}
""".replace("0x1p-20", repr(2.0**-20))

# Of a shadow that goes on for ever: corners behind the edge are directions, w = 0.  To both sides
# it is a pixel wider than it is.
_SHADOW_VERTEX = """
#version 330
uniform ivec2 pixel;
uniform vec2 part;
uniform float level;
uniform vec2 size;
in ivec4 ends;
in vec2 solid;
flat out vec4 line;
flat out int upright;

vec2 aside(vec2 corner, vec2 other) {
    vec2 across = vec2(-corner.y, corner.x) / length(corner);
    return corner - sign(dot(across, other - corner)) * across;
}

void main() {
    vec2 a = vec2(ends.xy - pixel) - part, b = vec2(ends.zw - pixel) - part;
    upright = ends.x == ends.z ? 1 : 0;
    float distance = upright == 1 ? a.x : a.y;
    vec2 reach = upright == 1 ? vec2(a.y, b.y) : vec2(a.x, b.x);
    line = vec4(distance, reach, (solid.x - level) / distance);
    bool faces = distance * solid.y > 0.0;
    if (abs(distance) < 1e-5 || faces != (solid.x > level)) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        return;
    }
    vec2 at = gl_VertexID == 0 ? aside(a, b) : gl_VertexID < 3 ? a
            : gl_VertexID < 5 ? b : aside(b, a);
    gl_Position = gl_VertexID == 1 || gl_VertexID == 3
        ? vec4(2.0 * normalize(at) / size, 0.0, 0.0)
        : vec4(2.0 * (at + vec2(pixel) + part) / size - 1.0, 0.0, 1.0);
}
"""

# The line from the eye to the middle of the pixel meets the edge, or it is no shadow of that edge.
# A sixteenth of a pixel beside it still counts, lest light falls in where two edges meet.
_SHADOW_FRAGMENT = """
#version 330
uniform ivec2 pixel;
uniform vec2 part;
uniform float level;
flat in vec4 line;
flat in int upright;
void main() {
    vec2 middle = (gl_FragCoord.xy - vec2(pixel)) - part;
    vec2 place = upright == 1 ? middle : middle.yx;
    float share = line.x / place.x;
    float meets = place.y * share;
    if (!(share > 0.0 && share < 1.0) || meets < line.y - 0.0625 || meets > line.z + 0.0625)
        discard;
    float rise = line.w * place.x;
    float off = 0x1p-20 * (1.0 + abs(level) + abs(rise));
    gl_FragDepth = clamp(level + rise - off, 0.0, 1.0);
}
""".replace("0x1p-20", repr(2.0**-20))


class UmbraBuffer:
    """Draws the umbra of a cell over a square window of pixels, a sample after the other.

    As a context manager it makes its OpenGL context current; all methods but :meth:`close` must be
    called inside.  Raises :class:`~simplifier.errors.BackendUnavailableError` where there is no
    OpenGL 3.3 with EGL.
    """

    def __init__(self) -> None:
        self._context, self._stencil = open_stencil("backend opengl", "--backend cpu")
        self.widest = 0
        self._framebuffer: Any = None
        self._shadows: Any = None
        self._columns: Any = None
        self._room = self._size = 0
        self._samples = 0
        self._low, self._range = 0.0, 1.0
        with self:
            context = self._context
            context.enable(context.DEPTH_TEST)
            self.widest = int(context.info["GL_MAX_TEXTURE_SIZE"])
            self._program = context.program(_SHADOW_VERTEX, _SHADOW_FRAGMENT)
            self._nothing, self._heights = (
                context.vertex_array(context.program(_EVERYWHERE_VERTEX, fragment), [])
                for fragment in (_NOTHING_FRAGMENT, _COLUMNS_FRAGMENT)
            )

    def __enter__(self) -> UmbraBuffer:
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

    def begin(self, size: int, low: float, high: float) -> None:
        """Clear a window of so many pixels a side, for heights from ``low`` to ``high``.

        ``size`` must not exceed :attr:`widest`.
        """
        if size > self._room:
            if self._framebuffer is not None:
                self._framebuffer.release()
            placeholder = self._context.depth_renderbuffer((size, size))
            self._framebuffer = self._context.framebuffer(depth_attachment=placeholder)
            self._framebuffer.use()
            self._stencil.attach(size, size)
            self._room = size
        self._framebuffer.use()
        self._framebuffer.viewport = (0, 0, size, size)
        self._size, self._samples = size, 0
        self._low, self._range = low, high - low
        self._program["size"] = (size, size)
        self._stencil.raise_depth()
        self._framebuffer.clear(depth=0.0)

    def load(self, solid: NDArray[np.float32], edges: ShadowEdges) -> None:
        """The occluders of the samples that follow.

        ``solid``  (size, size): up to where each pixel's column is solid; minus infinite where not.
        """
        context = self._context
        for old in (self._shadows, self._columns):
            if old is not None:
                old.release()
        shares = np.maximum((solid.T - self._low) / self._range, -1.0).astype(np.float32)
        self._columns = context.texture(
            solid.shape, 1, np.ascontiguousarray(shares).data, dtype="f4", alignment=4
        )
        self._columns.use(0)
        rows = np.zeros(max(len(edges), 1), dtype=[("ends", "4i4"), ("solid", "2f4")])
        if len(edges):
            rows["ends"] = edges.ends
            rows["solid"][:, 0] = (edges.heights - self._low) / self._range
            rows["solid"][:, 1] = edges.sides
        buffer = context.buffer(rows.tobytes())
        self._shadows = context.vertex_array(self._program, [(buffer, "4i 2f /i", "ends", "solid")])
        self._instances = len(edges)

    def add(self, x: float, y: float, eye: float) -> None:
        """Lower the umbra to the shadows of a sample; ``x`` and ``y`` in pixels of the window."""
        pixel = np.floor([x, y])
        self._program["pixel"] = tuple(pixel.astype(int).tolist())
        self._program["part"] = (x - pixel[0], y - pixel[1])
        self._program["level"] = (eye - self._low) / self._range
        if self._samples:
            self._stencil.clear()
            self._stencil.mark_greater()
            self._draw()
            self._stencil.select_zero(greater=False)
            self._nothing.render(self._context.TRIANGLES, vertices=3)
            self._stencil.select_zero(greater=True)
        self._draw()
        self._samples += 1

    def _draw(self) -> None:
        self._heights.render(self._context.TRIANGLES, vertices=3)
        if self._instances:
            kind = self._context.TRIANGLE_STRIP
            self._shadows.render(kind, vertices=6, instances=self._instances)

    def read(self) -> FloatArray:
        """(size, size) float64: the heights of the umbra by x and y, minus infinite where none."""
        depths = self._stencil.read_depth(self._size, self._size).T.astype(np.float64)
        heights = self._low + self._range * depths
        return np.ascontiguousarray(np.where(depths > 0.0, heights, -np.inf))
