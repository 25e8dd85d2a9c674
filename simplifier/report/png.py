"""Pictures to PNG bytes, without date and program name: equal pictures give equal files."""

from __future__ import annotations

import warnings
from typing import Any

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

RgbImage = NDArray[np.uint8]
"""(rows, columns, 3), row 0 at the top."""


def png_bytes(image: RgbImage) -> bytes:
    """PNG of an image."""
    # OpenCV takes an eighth of the time of matplotlib's own encoder.  Its default looks for runs
    # alone, which makes plots twice as large for a quarter less time.
    how = [
        cv2.IMWRITE_PNG_COMPRESSION,
        6,
        cv2.IMWRITE_PNG_STRATEGY,
        cv2.IMWRITE_PNG_STRATEGY_DEFAULT,
    ]
    _, data = cv2.imencode(".png", image[..., ::-1], how)
    return data.tobytes()


def figure_image(figure: Figure) -> RgbImage:
    """A figure at its own size, opaque; needs neither pyplot nor a display."""
    canvas: Any = FigureCanvasAgg(figure)  # matplotlib leaves its methods untyped
    with warnings.catch_warnings():
        # Letters of a name that the font lacks are drawn as boxes, which is enough.
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]
