"""What trimesh, scikit-image, SciPy and this code do alike: ``python -m bench.libraries``.

Each case runs in a process of its own, twice: the memory is what the first run took, the library
that it imports included, the time is the second's.  ``docs/decisions/0015`` draws the conclusions.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.meshes import ASSETS
from bench.record import Row, told, write_page, write_table
from simplifier.geometry.mesh import FloatArray, IntArray

RESULTS = Path("bench/results")
DRAGON = ASSETS / "dragon_871k.ply"
_L_SHAPE = np.array([[2, 0], [2, 1], [1, 1], [1, 2], [0, 2], [0, 0]], dtype=np.float64)


def main() -> None:
    """Run all cases and write the table, or one of them and print it."""
    parser = argparse.ArgumentParser(prog="python -m bench.libraries", description=__doc__)
    parser.add_argument("case", nargs="*", help=argparse.SUPPRESS)  # for its own processes
    case = parser.parse_args().case
    if case:
        print(json.dumps(_measure(*case)))
    else:
        _compare()


def _compare() -> None:
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for write in (_threemf, _collada):  # here, so that no case counts what writing takes
            write(Path(folder))
        for what, cases in CASES.items():
            for name in cases:
                command = [sys.executable, "-m", "bench.libraries", what, name, folder]
                done = subprocess.run(command, capture_output=True, text=True, check=True)
                rows.append({"what": what, "by": name, **json.loads(done.stdout.splitlines()[-1])})
                print(told(rows[-1]), flush=True)
    write_table(RESULTS / "libraries_compared.csv", rows, "python -m bench.libraries")
    write_page(RESULTS, "libraries", ["compared"])


def _measure(what: str, name: str, folder: str) -> dict[str, Any]:
    make, given = CASES[what][name], INPUTS[what](Path(folder))
    before = _start_peak()
    make(given)
    grown = _status("VmHWM") - before
    begin = time.process_time()
    found = make(given)
    seconds = time.process_time() - begin
    return {"CPU seconds": f"{seconds:.3g}", "MiB": f"{grown:.0f}", "found": found}


def _start_peak() -> float:
    """Forget the peak of the memory so far; what is in use, MiB."""
    Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _status(name: str) -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith(name)).split()[1]) / 1024.0


# Inputs.


def _ball(cuts: int) -> tuple[FloatArray, IntArray]:
    import trimesh

    made = trimesh.creation.icosphere(subdivisions=cuts)
    return np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int32)


def _threemf(folder: Path) -> Path:
    """A ball of 327,680 triangles, built twice with one part number."""
    path = folder / "balls.3mf"
    if path.exists():
        return path
    points, faces = _ball(7)
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>\n' for x, y, z in points.tolist())
    corners = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in faces.tolist())
    model = (
        '<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" name="ball"><mesh><vertices>{vertices}</vertices><triangles>{corners}'
        '</triangles></mesh></object></resources><build><item objectid="1" partnumber="M8"/>'
        '<item objectid="1" partnumber="M8" transform="1 0 0 0 1 0 0 0 1 5 0 0"/></build></model>'
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return path


def _collada(folder: Path) -> Path:
    """One L-shaped polygon of area 3, half a million units from the origin."""
    far = 500_000.01
    numbers = " ".join(f"{x + far} {y} 0" for x, y in _L_SHAPE.tolist())
    path = folder / "l.dae"
    path.write_text(
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        '<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="18">'
        f'{numbers}</float_array><technique_common><accessor source="#a" count="6" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
        '</accessor></technique_common></source><vertices id="v"><input semantic="POSITION"'
        ' source="#p"/></vertices><polylist count="1"><input semantic="VERTEX" source="#v"'
        ' offset="0"/><vcount>6</vcount><p>0 1 2 3 4 5</p></polylist></mesh></geometry>'
        '</library_geometries><library_visual_scenes><visual_scene id="s"><node>'
        '<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>'
        '<instance_visual_scene url="#s"/></scene></COLLADA>'
    )
    return path


def _solid(folder: Path) -> Any:
    """The dragon's, of 256 voxels along its longest edge."""
    import simplifier
    from simplifier.options.stages import SolidOptions
    from simplifier.progress import Stopwatch
    from simplifier.steps.solid import solidify

    watch = Stopwatch(lambda progress: None)
    return solidify(simplifier.load(DRAGON), SolidOptions(resolution=256), watch).filled


def _points(folder: Path) -> FloatArray:
    import simplifier

    return simplifier.load(DRAGON).vertices


def _star(folder: Path) -> FloatArray:
    """A polygon of 2,000 corners, in and out."""
    angles = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    lengths = np.where(np.arange(2000) % 2, 1.0, 0.5)
    return np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=1)


# What is compared.


def _corner_words(corners: FloatArray) -> str:
    area = np.linalg.norm(_crosses(corners), axis=1).sum() / 2.0
    return f"{len(corners)} triangles, area {area:.6g}, from x = {corners[..., 0].min():.2f}"


def _crosses(corners: FloatArray) -> FloatArray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _ours(path: Path) -> str:
    import simplifier

    mesh = simplifier.load(path)
    corners = mesh.vertices[mesh.faces]
    return _corner_words(corners)


def _by_trimesh(path: Path) -> str:
    import trimesh

    mesh = trimesh.load(path, force="mesh", process=False)
    return _corner_words(np.asarray(mesh.triangles))


def _surface_nets(solid: Any) -> str:
    from simplifier.geometry.room import WHOLE
    from simplifier.refinement.starts import inner_surface

    vertices, faces = inner_surface(np.where(solid.inside, WHOLE, 0).astype(np.uint8))
    return _surface_words(vertices, faces)


def _marching_cubes(solid: Any) -> str:
    """Of the field that the surface nets take, too."""
    from scipy import ndimage
    from skimage.measure import marching_cubes

    from simplifier.refinement.decimate import coarse

    field = np.pad(coarse(solid.inside)[0], 2)
    for _ in range(2):
        for axis in range(3):
            field = ndimage.convolve1d(field, [0.25, 0.5, 0.25], axis=axis, mode="constant")
    vertices, faces, _, _ = marching_cubes(field, 0.5)
    return _surface_words(vertices, faces)


def _surface_words(vertices: FloatArray, faces: IntArray) -> str:
    areas = np.linalg.norm(_crosses(vertices[faces]), axis=1)
    slivers = int((areas < 1e-3 * areas.mean()).sum())
    return f"{len(faces)} triangles, {slivers} of them slivers"


def _labels_of_scipy(solid: Any) -> str:
    from scipy import ndimage

    return f"{ndimage.label(~solid.inside)[1]} spaces"


def _labels_of_skimage(solid: Any) -> str:
    from skimage.measure import label

    return f"{label(~solid.inside, connectivity=1, return_num=True)[1]} spaces"


def _hull_of_scipy(points: FloatArray) -> str:
    from scipy.spatial import ConvexHull

    return f"{len(ConvexHull(points).vertices)} corners"


def _hull_of_trimesh(points: FloatArray) -> str:
    import trimesh

    return f"{len(trimesh.convex.convex_hull(points).vertices)} corners"


def _earcut(star: FloatArray) -> str:
    from simplifier.io.polygons import triangulate_polygons

    points = np.column_stack([star, np.zeros(len(star))])
    sizes, corners = np.array([len(star)]), np.arange(len(star))
    return f"{len(triangulate_polygons(points, sizes, corners, where='star'))} triangles"


def _earcut_of_trimesh(star: FloatArray) -> str:
    import trimesh
    from shapely.geometry import Polygon

    faces = trimesh.creation.triangulate_polygon(Polygon(star), engine="earcut")[1]
    return f"{len(faces)} triangles"


INPUTS: dict[str, Callable[[Path], Any]] = {
    "read 3MF": _threemf,
    "read COLLADA": _collada,
    "surface of a solid": _solid,
    "label spaces": _solid,
    "convex hull": _points,
    "cut a polygon": _star,
}
CASES: dict[str, dict[str, Callable[[Any], str]]] = {
    "read 3MF": {"simplifier": _ours, "trimesh": _by_trimesh},
    "read COLLADA": {"simplifier": _ours, "trimesh": _by_trimesh},
    "surface of a solid": {"simplifier": _surface_nets, "scikit-image": _marching_cubes},
    "label spaces": {"scipy": _labels_of_scipy, "scikit-image": _labels_of_skimage},
    "convex hull": {"scipy": _hull_of_scipy, "trimesh": _hull_of_trimesh},
    "cut a polygon": {"simplifier": _earcut, "trimesh": _earcut_of_trimesh},
}

if __name__ == "__main__":
    main()
