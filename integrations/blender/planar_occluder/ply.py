"""Binary PLY of triangles, as the ``occluder`` command reads and writes it."""

import numpy as np

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
_END = b"end_header\n"


def encode(vertices, faces):
    """Bytes of vertices (n, 3) and faces (m, 3)."""
    rows = np.empty(len(faces), _FACE)
    rows["count"] = 3
    rows["corners"] = faces
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\n"
    )
    return header.encode() + _END + np.asarray(vertices, "<f8").tobytes() + rows.tobytes()


def decode(data):
    """Vertices (n, 3) float64 and faces (m, 3) of what :func:`encode` or the command wrote.

    Raises ValueError for anything else.
    """
    header, end, body = data.partition(_END)
    counts = {
        words[1]: int(words[2])
        for words in map(bytes.split, header.splitlines())
        if words[:1] == [b"element"]
    }
    if not end or set(counts) != {b"vertex", b"face"}:
        raise ValueError("this is no PLY of triangles")
    size = 24 * counts[b"vertex"]
    if len(body) != size + _FACE.itemsize * counts[b"face"]:
        raise ValueError("the PLY is shorter or longer than its header says")
    vertices = np.frombuffer(body[:size], "<f8").reshape(-1, 3)
    return vertices, np.frombuffer(body[size:], _FACE)["corners"]
