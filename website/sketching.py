"""What sketches are made of: pieces of SVG, by coordinates to the right and down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from math import cos, pi, sin

MESH, OCCLUDER, MISSED, WRONG = "#9aa3ad", "#fac81e", "#141414", "#1e5adc"
INK, FAINT, GOOD, PALE, PINK = "#33404d", "#c4ccd4", "#1a7a3c", "#eef1f4", "#d6006c"

Points = Sequence[tuple[float, float]]
Sketch = Sequence[str]


def shape(points: Points, fill: str = MESH, edge: str = "none", more: str = "") -> str:
    """A polygon; ``more`` is further attributes."""
    where = " ".join(f"{x:g},{y:g}" for x, y in points)
    return f'<polygon points="{where}" fill="{fill}" stroke="{edge}" stroke-width="1.5"{more}/>'


def box(
    x: float, y: float, width: float, height: float, fill: str = MESH, edge: str = "none"
) -> str:
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" fill="{fill}" '
        f'stroke="{edge}" stroke-width="1.5"/>'
    )


def line(points: Points, colour: str = INK, width: float = 1.5, dashed: bool = False) -> str:
    where = " ".join(f"{x:g},{y:g}" for x, y in points)
    dashes = ' stroke-dasharray="4 3"' if dashed else ""
    return (
        f'<polyline points="{where}" fill="none" stroke="{colour}" '
        f'stroke-width="{width:g}"{dashes}/>'
    )


def disc(x: float, y: float, radius: float, fill: str = MESH, edge: str = "none") -> str:
    return (
        f'<circle cx="{x:g}" cy="{y:g}" r="{radius:g}" fill="{fill}" stroke="{edge}" '
        f'stroke-width="1.5"/>'
    )


def word(x: float, y: float, text: str, colour: str = INK, size: float = 11) -> str:
    """Centred at x; y is its baseline."""
    return (
        f'<text x="{x:g}" y="{y:g}" fill="{colour}" font-size="{size:g}" text-anchor="middle" '
        f'font-family="sans-serif">{escape(text)}</text>'
    )


def arrow(start: tuple[float, float], end: tuple[float, float], colour: str = INK) -> str:
    (x, y), (u, v) = start, end
    long = ((u - x) ** 2 + (v - y) ** 2) ** 0.5
    a, b = (u - x) / long, (v - y) / long
    head = [
        (u, v),
        (u - 7 * a - 3.5 * b, v - 7 * b + 3.5 * a),
        (u - 7 * a + 3.5 * b, v - 7 * b - 3.5 * a),
    ]
    return line([start, (u - 5 * a, v - 5 * b)], colour) + shape(head, colour)


def eye(x: float, y: float) -> str:
    """A viewer who looks to the right."""
    return shape([(x - 6, y - 5), (x - 6, y + 5), (x + 4, y)], INK) + disc(x - 6, y, 5, INK)


def house(x: float, y: float, size: float = 1.0, fill: str = MESH, edge: str = "none") -> str:
    """40 wide and 50 high at size 1, from its upper left corner."""
    return shape(house_points(x, y, size), fill, edge)


def house_points(x: float, y: float, size: float = 1.0) -> Points:
    outline = [(0, 20), (20, 0), (40, 20), (40, 50), (0, 50)]
    return [(x + size * u, y + size * v) for u, v in outline]


def blob(x: float, y: float, radius: float) -> Points:
    """A round outline with bumps."""
    turns = [2 * pi * step / 48 for step in range(48)]
    reach = [radius * (1 + 0.13 * sin(3 * turn + 0.6) + 0.06 * cos(7 * turn)) for turn in turns]
    return [(x + r * cos(turn), y + r * sin(turn)) for r, turn in zip(reach, turns, strict=True)]


def ring(x: float, y: float, radius: float, corners: int) -> Points:
    turns = [2 * pi * (step + 0.5) / corners for step in range(corners)]
    return [(x + radius * cos(turn), y + radius * sin(turn)) for turn in turns]


def cells(x: float, y: float, side: float, columns: int, rows: int, colour: str = FAINT) -> Sketch:
    """The lines of a grid."""
    right, low = x + side * columns, y + side * rows
    return [
        *(line([(x + side * i, y), (x + side * i, low)], colour, 1) for i in range(columns + 1)),
        *(line([(x, y + side * j), (right, y + side * j)], colour, 1) for j in range(rows + 1)),
    ]


def voxels(picture: str, x: float, y: float, side: float, fills: Mapping[str, str]) -> Sketch:
    """A square for each letter of ``picture`` that has a colour, row by row."""
    return [
        box(x + side * column, y + side * row, side, side, fills[letter], "#ffffff")
        for row, letters in enumerate(picture.split())
        for column, letter in enumerate(letters)
        if letter in fills
    ]
