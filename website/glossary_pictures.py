"""The glossary's pictures, a sketch a term; ``python -m website.glossary_pictures`` writes them.

Colours mean what they mean in reports: grey is the mesh, yellow the occluder and what it hides
rightly, black what is missed, blue what is hidden wrongly.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from html import escape
from math import cos, sin
from pathlib import Path

from website.sketching import (
    FAINT,
    GOOD,
    INK,
    MESH,
    MISSED,
    OCCLUDER,
    PALE,
    PINK,
    WRONG,
    Sketch,
    arrow,
    blob,
    box,
    cells,
    disc,
    eye,
    house,
    line,
    ring,
    shape,
    voxels,
    word,
)  # fmt: skip

FOLDER = Path("docs/images/glossary")
WIDTH, HEIGHT = 160, 100

_SHELL = "..###.. .#ooo#. #ooooo# #ooooo# #ooooo# .#ooo#. ..###.."

PICTURES: Mapping[str, Sketch] = {
    "Occluder": [
        shape(blob(48, 50, 33)),
        arrow((88, 50), (104, 50)),
        shape(ring(130, 50, 24, 6), OCCLUDER, INK),
    ],
    "Occlusion culling": [
        eye(18, 50),
        shape([(22, 50), (150, 4), (150, 96)], PALE),
        box(58, 30, 12, 40, OCCLUDER),
        shape([(70, 30), (150, 0), (150, 100), (70, 70)], FAINT),
        house(92, 32, 0.7, "none", INK),
        disc(92, 16, 6),
        disc(92, 86, 6),
        word(124, 86, "not drawn", INK, 10),
    ],
    "Occludee": [
        eye(16, 50),
        box(52, 24, 10, 52, OCCLUDER),
        house(96, 26, 0.95, MESH, INK),
        line([(22, 48), (96, 30)], FAINT, 1.5, True),
        line([(22, 52), (96, 72)], FAINT, 1.5, True),
        word(116, 94, "tested", INK, 10),
    ],
    "Budget": [
        *(
            shape([(20 + 24 * i, 66), (32 + 24 * i, 40), (44 + 24 * i, 66)], OCCLUDER, INK)
            for i in range(5)
        ),
        word(80, 26, "at most 5"),
        line([(20, 78), (140, 78)], INK, 1.5),
    ],
    "Watertight": [
        line([*ring(42, 44, 28, 14), ring(42, 44, 28, 14)[0]], INK, 3),
        word(42, 92, "watertight", GOOD, 10),
        line(ring(118, 44, 28, 14)[2:], INK, 3),
        word(118, 92, "a hole", "#b3261e", 10),
    ],
    "Voxel": [
        *cells(28, 8, 12, 9, 7),
        shape(blob(82, 50, 32), "none", INK),
        box(76, 44, 12, 12, OCCLUDER, INK),
    ],
    "Solid": voxels(_SHELL, 40, 9, 12, {"#": MESH, "o": OCCLUDER}),
    "Section": [
        shape(blob(80, 50, 38), MESH),
        line([(20, 62), (140, 38)], PINK, 2),
        line([(45, 57), (114, 43)], OCCLUDER, 5),
        word(136, 30, "plane", PINK, 10),
    ],
    "Refinement": [
        shape(blob(80, 50, 36)),
        shape(ring(80, 50, 22, 5), "none", INK),
        shape(ring(80, 50, 32, 5), OCCLUDER, INK),
        arrow((80, 50), (80, 20)),
        arrow((80, 50), (110, 62)),
        arrow((80, 50), (50, 62)),
    ],
    "Level of detail": [
        shape(ring(32, 48, 26, 10), OCCLUDER, INK),
        shape(ring(88, 48, 20, 6), OCCLUDER, INK),
        shape(ring(134, 48, 14, 4), OCCLUDER, INK),
        word(32, 92, "near"),
        word(134, 92, "far"),
        arrow((56, 88), (110, 88)),
    ],
    "Pixel error": [
        *cells(20, 10, 16, 7, 5),
        line([(20, 62), (132, 30)], MESH, 4),
        line([(20, 76), (132, 44)], OCCLUDER, 4),
        arrow((76, 46), (76, 59), PINK),
        word(112, 84, "1 pixel", PINK),
    ],
    "Conservative": [shape(blob(80, 50, 40)), shape(ring(79, 49, 28, 7), OCCLUDER, INK)],
    "Shrink": [
        shape(ring(80, 50, 42, 6), "none", INK),
        shape(ring(80, 50, 28, 6), OCCLUDER, INK),
        arrow((80, 86), (80, 75), PINK),
        arrow((44, 50), (54, 50), PINK),
        arrow((116, 50), (106, 50), PINK),
    ],
    "Overrides": [
        shape(
            [(24, 86), (24, 24), (136, 24), (136, 86), (100, 86), (100, 56), (60, 56), (60, 86)],
            OCCLUDER,
        ),
        box(60, 56, 40, 30, "#ffffff", PINK),
        word(80, 75, "open", PINK, 10),
        box(24, 12, 30, 12, "#f08030"),
        word(100, 19, "by hand", "#b05010", 10),
    ],
    "Recall": [
        house(46, 10, 1.6, MISSED),
        box(58, 44, 44, 46, OCCLUDER),
        word(130, 40, "missed", INK, 10),
        line([(112, 38), (96, 34)], INK, 1),
        word(80, 72, "hidden", INK, 10),
    ],
    "Precision": [
        house(46, 10, 1.6, OCCLUDER),
        shape([(110, 42), (134, 54), (134, 90), (110, 90)], WRONG),
        word(80, 70, "rightly", INK, 10),
        word(136, 44, "wrongly", WRONG, 10),
    ],
    "Silhouette": [
        eye(16, 50),
        house(44, 26, 0.95, MESH, INK),
        arrow((88, 50), (104, 50)),
        house(110, 22, 1.05, MISSED),
    ],
    "Overhang": [
        shape(blob(74, 52, 34)),
        shape([(80, 24), (138, 34), (104, 60)], WRONG),
        line([(106, 58), (138, 34)], PINK, 1.5, True),
        word(126, 76, "stick-out", PINK, 10),
    ],
    "Front": [
        eye(14, 50),
        box(58, 18, 10, 64, OCCLUDER),
        line([(140, 14), (140, 86)], MESH, 8),
        disc(104, 50, 8, WRONG),
        line([(72, 50), (92, 50)], WRONG, 1.5, True),
        word(104, 76, "vanishes", WRONG, 10),
    ],
    "Error bound": [
        line([(16, 70), (60, 40), (104, 52), (146, 30)], MESH, 6),
        line([(16, 52), (70, 28), (146, 16)], OCCLUDER, 4),
        line([(16, 44), (60, 14), (104, 26), (146, 4)], PINK, 1.5, True),
        arrow((104, 52), (104, 28), PINK),
        word(104, 82, "no further", PINK),
    ],
    "Coverage": [
        house(20, 20, 1.2, MESH),
        *(
            line([(124, 84), (124 + 24 * cos(turn), 46 + 28 * sin(turn))], MESH, 1.5)
            for turn in (3.6, 4.2, 4.71, 5.2, 5.8)
        ),
        word(44, 96, "much", INK, 10),
        word(124, 96, "hardly any", INK, 10),
    ],
    "Occlusion measure": [
        shape(ring(62, 50, 36, 8), OCCLUDER),
        *(arrow((8, y), (150, y), FAINT) for y in (22, 36, 50, 64, 78)),
        shape(ring(62, 50, 36, 8), OCCLUDER, INK),
        line([(108, 22), (108, 78)], PINK, 2),
        word(130, 54, "wide", PINK),
    ],
    "Verdict": [
        disc(34, 44, 18, GOOD),
        disc(80, 44, 18, "#e0a020"),
        disc(126, 44, 18, "#b3261e"),
        word(34, 82, "good"),
        word(80, 82, "weak"),
        word(126, 82, "unusable"),
    ],
    "Loss": [
        house(56, 14, 1.3, "#fee838"),
        shape([(56, 40), (82, 14), (108, 40)], "#7d7c78"),
        shape([(69, 27), (82, 14), (95, 27)], "#00224e"),
        box(20, 86, 40, 7, "#fee838"),
        box(60, 86, 40, 7, "#7d7c78"),
        box(100, 86, 40, 7, "#00224e"),
    ],
    "Worst view": [
        shape(blob(80, 50, 22)),
        *(
            disc(80 + 42 * cos(turn), 50 + 40 * sin(turn), 4, MESH)
            for turn in (0, 0.8, 1.6, 2.4, 3.2, 4.0, 4.8)
        ),
        line([(106, 16), (118, 28)], "#b3261e", 3),
        line([(118, 16), (106, 28)], "#b3261e", 3),
        arrow((106, 28), (94, 40), "#b3261e"),
    ],
    "Part": [
        house(16, 34),
        house(62, 24, 1.2, OCCLUDER, INK),
        house(118, 40, 0.8),
        line([(8, 86), (152, 86)]),
    ],
    "Tree of occluders": [
        line([(80, 22), (44, 50)]),
        line([(80, 22), (116, 50)]),
        line([(44, 50), (26, 80)]),
        line([(44, 50), (62, 80)]),
        line([(116, 50), (98, 80)]),
        line([(116, 50), (134, 80)]),
        shape(ring(80, 22, 13, 4), OCCLUDER, INK),
        *(shape(ring(x, 50, 11, 6), OCCLUDER, INK) for x in (44, 116)),
        *(shape(ring(x, 80, 9, 10), OCCLUDER, INK) for x in (26, 62, 98, 134)),
    ],
    "Depth buffer": [
        *(
            box(24 + 16 * c, 10 + 16 * r, 16, 16, shade, "#ffffff")
            for r, row in enumerate(("ffffffff"[:7], "f55ff99", "f555999", "5555999", "5555999"))
            for c, letter in enumerate(row)
            for shade in [{"f": PALE, "5": "#4d5a67", "9": "#98a4af"}[letter]]
        ),
    ],
    "Item buffer": [
        *(
            box(24 + 16 * c, 10 + 16 * r, 16, 16, shade, "#ffffff")
            for r, row in enumerate(("fffffff", "faaffcc", "faaaccc", "aaaaccc", "aaabbcc"))
            for c, letter in enumerate(row)
            for shade in [{"f": PALE, "a": "#3b7fc4", "b": "#d2691e", "c": "#5a9e4b"}[letter]]
        ),
    ],
    "Wrong pixel": [
        *cells(24, 10, 16, 7, 5),
        *voxels("aaa aaa aaa", 56, 26, 16, {"a": MESH}),
        box(104, 42, 16, 16, WRONG),
    ],
    "Camera path": [
        house(14, 8, 0.8),
        house(66, 48, 0.8),
        house(118, 8, 0.8),
        line([(12, 80), (50, 62), (80, 34), (112, 62), (148, 80)], PINK, 2),
        *(disc(x, y, 4, PINK) for x, y in ((12, 80), (50, 62), (80, 34), (112, 62), (148, 80))),
    ],
    "View cell": [
        *cells(20, 10, 20, 6, 4),
        box(60, 30, 20, 20, "#f3b6d3", PINK),
        *(disc(*at, 2.5, INK) for at in ((65, 35), (74, 41), (66, 45))),
    ],
    "Potentially visible set": [
        box(10, 40, 20, 20, "#f3b6d3", PINK),
        box(54, 18, 10, 50, OCCLUDER),
        disc(46, 84, 8, GOOD),
        disc(90, 10, 8, GOOD),
        disc(90, 90, 8, GOOD),
        disc(112, 42, 8, "none", MESH),
        disc(138, 46, 8, "none", MESH),
    ],
    "Umbra": [
        box(10, 34, 20, 32, "#f3b6d3", PINK),
        shape([(76, 20), (160, -5), (160, 105), (76, 80)], FAINT),
        box(66, 20, 10, 60, OCCLUDER),
        line([(30, 34), (76, 20), (160, -5)], PINK, 1, True),
        line([(30, 66), (76, 80), (160, 105)], PINK, 1, True),
        word(114, 54, "hidden"),
    ],
    "Occluder fusion": [
        box(8, 40, 16, 20, "#f3b6d3", PINK),
        shape([(72, 16), (150, 16), (150, 84), (72, 84)], FAINT),
        box(56, 16, 12, 36, OCCLUDER),
        box(72, 48, 12, 36, OCCLUDER),
        disc(124, 50, 10, "none", INK),
    ],
    "Leak": [
        box(8, 40, 20, 20, "#f3b6d3", PINK),
        box(66, 10, 10, 34, OCCLUDER),
        box(66, 56, 10, 34, OCCLUDER),
        arrow((28, 50), (112, 50), "#b3261e"),
        disc(126, 50, 10, "none", "#b3261e"),
        word(126, 80, "not in the set", "#b3261e", 10),
    ],
    "Cull map": [
        box(8, 60, 20, 12, "#f3b6d3", PINK),
        box(62, 46, 12, 42, OCCLUDER),
        shape([(74, 41), (152, 9), (152, 88), (74, 88)], FAINT),
        line([(28, 60), (74, 41)], PINK, 1, True),
        line([(74, 41), (152, 9)], PINK, 2),
        word(114, 66, "hidden below"),
        line([(4, 88), (154, 88)], INK),
    ],
    "Slice": [
        *(box(28 + 26 * i, 24, 24, 52, OCCLUDER if i < 2 else FAINT) for i in range(4)),
        word(52, 92, "drawn", INK, 10),
        word(106, 92, "skipped", INK, 10),
    ],
    "Voxel column": [
        *(
            box(12 + 17 * i, 86 - h, 17, h, OCCLUDER if i == 3 else MESH, "#ffffff")
            for i, h in enumerate((16, 24, 34, 50, 40, 26, 18, 12))
        ),
        arrow((71, 32), (71, 8), PINK),
    ],
    "Manifest": [
        box(48, 8, 64, 84, "#ffffff", INK),
        *(line([(58, y), (102, y)], FAINT, 3) for y in (24, 36, 48, 60, 72)),
        *(disc(58, y, 3, GOOD) for y in (24, 48, 72)),
    ],
    "Asset": [
        line([(20, 84), (146, 84)], INK),
        line([(20, 84), (20, 10)], INK),
        line([(24, 66), (54, 50), (84, 54), (114, 32), (142, 26)], WRONG, 2.5),
        *(disc(*at, 4, WRONG) for at in ((24, 66), (54, 50), (84, 54), (114, 32), (142, 26))),
    ],
    "Job": [
        house(14, 32, 0.75, MESH),
        arrow((50, 50), (66, 50)),
        disc(84, 50, 14, PALE, INK),
        disc(84, 50, 5, INK),
        arrow((102, 50), (118, 50)),
        shape(ring(136, 50, 15, 6), OCCLUDER, INK),
    ],
    "Threshold": [
        line([(14, 40), (146, 40)], PINK, 2, True),
        box(34, 26, 24, 60, GOOD),
        box(76, 34, 24, 52, GOOD),
        box(118, 58, 24, 28, "#b3261e"),
        line([(14, 86), (146, 86)]),
    ],
    "Webhook": [
        box(12, 34, 44, 32, PALE, INK),
        word(34, 54, "service", INK, 10),
        arrow((58, 50), (100, 50), PINK),
        box(104, 34, 44, 32, PALE, INK),
        word(126, 54, "yours", INK, 10),
        word(79, 42, "ended", PINK, 9),
    ],
    "Tenant": [
        box(10, 12, 64, 76, PALE, INK),
        box(86, 12, 64, 76, PALE, INK),
        house(26, 30, 0.8),
        house(102, 30, 0.8, OCCLUDER),
        line([(80, 6), (80, 94)], PINK, 2, True),
    ],
    "Lease": [
        disc(80, 50, 36, "#ffffff", INK),
        shape([(80, 50), (80, 18), (104, 28), (112, 50), (80, 50)], OCCLUDER),
        line([(80, 50), (80, 18)], INK, 2),
        line([(80, 50), (112, 50)], INK, 2),
    ],
}
"""By the term as the glossary has it."""


def file_name(term: str) -> str:
    return f"{term.lower().replace(' ', '_')}.svg"


def svg_text(term: str) -> str:
    """The whole file; the same bytes every time."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}"><title>{escape(term)}</title>'
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="6" fill="#ffffff"/>\n'
        + "\n".join(PICTURES[term])
        + "\n</svg>\n"
    )


def main(folder: Path = FOLDER) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for term in PICTURES:
        (folder / file_name(term)).write_text(svg_text(term), "utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
