"""What a file is by its first bytes, to name the mistake when that is not what its suffix says."""

from __future__ import annotations

import re

# (pattern at the start of the file, what that is, suffixes of the formats that may begin so)
_SIGNATURES: tuple[tuple[re.Pattern[bytes], str, tuple[str, ...]], ...] = tuple(
    (re.compile(pattern, re.DOTALL), name, suffixes)
    for pattern, name, suffixes in (
        (rb"glTF", "a binary glTF (GLB) file", (".glb", ".gltf")),
        (rb"ply[ \t]*[\r\n]", "a PLY file", (".ply",)),
        (rb"(\xef\xbb\xbf)?\s*\[gd_(resource|scene)\b", "a Godot text resource", (".tres",)),
        (rb"(\xef\xbb\xbf)?\s*\{.{0,4096}\"asset\"", "a glTF (JSON) file", (".gltf", ".glb")),
        (rb"(ST)?C?N?4?n?OFF\s", "an OFF file", (".off",)),
        (rb"solid\b[^\r\n]*[\r\n]+\s*facet\b", "a text STL file", (".stl",)),
        (rb"PK\x03\x04", "a ZIP archive (3MF, USDZ, …)", ()),
        (rb"\x1f\x8b", "a gzip archive", ()),
        (rb"Kaydara FBX Binary", "a binary FBX file", ()),
        (rb"BLENDER", "a Blender file", ()),
        (rb"#usda|PXR-USDC", "a USD file", ()),
        (rb"\x89PNG|\xff\xd8\xff", "a picture", ()),
        (rb"\xff\xfe|\xfe\xff", "UTF-16 or UTF-32 text (save it as UTF-8)", ()),
        # Without a mark: every other byte of plain letters is 0.  A binary STL may begin so.
        (rb"([\t\n\r -~]\0){8}|(\0[\t\n\r -~]){8}", "UTF-16 text (save it as UTF-8)", (".stl",)),
        (rb"version https://git-lfs", "a Git LFS pointer (run 'git lfs pull')", ()),
        (rb"(?i)\s*<(!doctype )?html\b", "a web page", ()),
        (rb"(\xef\xbb\xbf)?\s*<\?xml", "an XML file (COLLADA, X3D, …)", ()),
    )
)


def foreign_content(data: bytes, suffix: str) -> str:
    """What the file is, when that is certain and not what ``suffix`` says; else an empty string."""
    head = data[:8192]
    for pattern, name, suffixes in _SIGNATURES:
        if pattern.match(head):
            return "" if suffix in suffixes else name
    return ""
