"""Colours that mean the same on every page, and in the pictures that jobs draw."""

from __future__ import annotations

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

BOTH: Colour = (250, 200, 30)
"""What original and occluder cover: hidden rightly."""
MISSED: Colour = (20, 20, 20)
"""What only the original covers: not hidden."""
WRONG: Colour = (30, 90, 220)
"""What only the occluder covers: hidden wrongly."""
NEITHER: Colour = (255, 255, 255)
