"""What an engine gets, timed: ``python -m bench.engine [--scene FILE.occs --path FILE.json]``.

    raster   10,000 triangles and 10,000 boxes at 320 x 180 (bench/city.py), from three heights: by
             the C header, from Python, and by Intel's Masked Occlusion Culling where ``MOC_SOURCE``
             names a folder of its sources
    walk     frames of a scene along a path, with and without a budget of triangles: by the C
             header and from Python, with the time to open the file

One thread, medians.  Without ``--scene`` it is Lyon of the shared scenes and a walk in its streets;
it is built in ``out/bench`` where it is not there, which takes minutes.  Needs a C compiler.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.city import City, city
from bench.rates import seconds
from bench.record import Row, told, write_page, write_table
from bench.scenes import FRAMES, SCENES, WORK
from simplifier.camera_paths.generate import generate_path
from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera, CameraPath, Lens
from simplifier.geometry.packed_tree import PackedTree
from simplifier.io.camera_path import load_camera_path
from simplifier.io.occs_file import load_packed_tree
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import PathOptions

RESULTS = Path("bench/results")
ROWS, COLUMNS = 180, 320
HEIGHTS = (1.7, 30.0, 150.0)  # metres: on foot, on a roof, in the air
BUDGETS = (None, 2000, 1000, 500)  # triangles a frame
_ERROR = 0.05  # metres that the city's houses may be off
_HERE = Path(__file__).parent
_HEADERS = _HERE.parent / "integrations" / "c"
_TESTED = _HERE.parent / "tests" / "integrations" / "c"
# What newer compilers miss in Intel's sources, and what they have by these names already.
_INTEL = (
    "#include <cstddef>\n#include <new>\n#include <cpuid.h>\n#include <immintrin.h>\n"
    "#define __cpuidex moc_cpuidex\n#define _xgetbv moc_xgetbv\n"
)


def compiled(folder: Path) -> Path:
    """The program of ``engine.c``, with AVX2 where this processor has it."""
    program = folder / "engine"
    command = [os.environ.get("CC") or "cc", "-O3", "-std=c99", "-ffp-contract=off", *_avx2()]
    source = str(_HERE / "engine.c")
    subprocess.run(
        [*command, f"-I{_HEADERS}", f"-I{_TESTED}", source, "-o", str(program), "-lm"], check=True
    )
    return program


def _avx2() -> list[str]:
    code = 'int main(void) { return !__builtin_cpu_supports("avx2"); }'
    with tempfile.TemporaryDirectory() as name:
        program = Path(name) / "asked"
        made = subprocess.run(
            ["cc", "-x", "c", "-", "-o", str(program)], input=code, text=True, capture_output=True
        )
        has = made.returncode == 0 and subprocess.run([program]).returncode == 0
    return ["-mavx2"] if has else []


def compiled_intel(folder: Path, source: Path) -> Path:
    """The program of ``engine_intel.cpp`` with Intel's sources, each for its instructions."""
    prefix = folder / "prefix.h"
    prefix.write_text(_INTEL)
    objects = []
    for name, flags in (
        ("MaskedOcclusionCulling", ["-msse4.1"]),
        ("MaskedOcclusionCullingAVX2", ["-mavx2", "-mfma"]),
        ("MaskedOcclusionCullingAVX512", ["-mavx512f", "-mavx512dq", "-mavx512bw", "-mfma"]),
    ):
        objects.append(str(folder / f"{name}.o"))
        command = ["c++", "-O3", "-std=c++11", "-w", "-include", str(prefix), *flags]
        path = str(source / f"{name}.cpp")
        subprocess.run([*command, "-c", path, "-o", objects[-1]], check=True)
    program = folder / "engine_intel"
    command = ["c++", "-O3", "-std=c++11", "-mavx2", f"-I{source}", str(_HERE / "engine_intel.cpp")]
    subprocess.run([*command, *objects, "-o", str(program)], check=True)
    return program


def view_numbers(camera: Camera) -> list[float]:
    """(16) as ``engine.c`` looks."""
    focal = Lens(ROWS, camera.fov).focal
    axes = np.ravel(camera.axes).tolist()
    return [*camera.position.tolist(), *axes, focal, camera.near, ROWS, COLUMNS]


def write_city(path: Path, scene: City) -> None:
    """Vertices are shared and come in the order of first use."""
    corners = scene.triangles.reshape(-1, 3)
    vertices, first, faces = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    place = np.argsort(np.argsort(first))
    vertices, faces = vertices[np.argsort(first)], place[faces.reshape(-1)]
    counts = [len(vertices), len(faces) // 3, len(scene.boxes), _ERROR]
    eye = scene.camera.position
    path.write_bytes(
        np.array([*view_numbers(scene.camera), *counts]).tobytes()
        + (vertices - eye).astype(np.float32).tobytes()
        + (scene.boxes - eye).astype(np.float32).tobytes()
        + faces.astype(np.uint32).tobytes()
    )


def raster_rows(folder: Path, heights: Sequence[float] = HEIGHTS) -> Iterator[Row]:
    """A row for each height and rasteriser; ``to_intel`` is the whole time to that of Intel's."""
    program = compiled(folder)
    source = os.environ.get("MOC_SOURCE")
    intel = compiled_intel(folder, Path(source)) if source else None
    for height in heights:
        scene = city(height)
        write_city(folder / "city", scene)
        rows = [
            ("occluder_buffer.h", _times([program, "raster", folder / "city"])),
            ("Python", _python_times(scene)),
        ]
        if intel is not None:
            for scale in (1, 4):
                size = str(scale * COLUMNS), str(scale * ROWS)
                name = f"Intel's, {size[0]} x {size[1]}"
                rows.append((name, _times([intel, folder / "city", *size])))
        whole = rows[2][1][0] + rows[2][1][1] if intel is not None else None
        for name, (draw, test, hidden) in rows:
            yield {
                "height_m": height, "by": name, "draw_ms": draw, "test_ms": test,
                "hidden": hidden, "to_intel": None if whole is None else (draw + test) / whole,
            }  # fmt: skip


def _times(command: Sequence[str | Path]) -> tuple[float, ...]:
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return tuple(map(float, done.stdout.split()))


def _python_times(scene: City) -> tuple[float, float, float]:
    buffer = DepthBuffer(ROWS, COLUMNS)

    def draw() -> None:
        buffer.draw(scene.triangles, scene.camera, _ERROR)

    def draw_again() -> None:
        buffer.clear()
        draw()

    draws = seconds(draw, buffer.clear)
    tests = seconds(lambda: buffer.test(scene.boxes, scene.camera), draw_again)
    hidden = np.mean(buffer.test(scene.boxes, scene.camera) == Verdict.HIDDEN)
    return 1e3 * draws, 1e3 * tests, float(hidden)


def walk_rows(folder: Path, scene: Path, path: CameraPath) -> Iterator[Row]:
    """A row for each budget; times are medians over the frames of each frame's median."""
    program, packed = compiled(folder), load_packed_tree(scene)
    numbers = [view_numbers(camera) for camera in path.cameras]
    (folder / "views").write_bytes(np.array(numbers).tobytes())
    whole = None
    for budget in BUDGETS:
        most = "-1" if budget is None else str(budget)
        found = _times([program, "walk", scene, folder / "views", most])
        times, triangles, nodes, hidden = np.reshape(found[1:], (-1, 4)).T
        whole = hidden.sum() if whole is None else whole
        yield {
            "budget": "none" if budget is None else budget, "frames": len(path.cameras),
            "bytes": scene.stat().st_size, "open_ms": found[0],
            "c_ms": float(np.median(times)), "c_worst_ms": float(times.max()),
            "python_ms": _python_walk(packed, path, budget), "triangles": float(triangles.mean()),
            "most_triangles": int(triangles.max()), "nodes": float(nodes.mean()),
            "hidden_of_whole": float(hidden.sum() / max(whole, 1)),
        }  # fmt: skip


def _python_walk(packed: PackedTree, path: CameraPath, budget: int | None) -> float:
    culler = Culler(packed, DepthBuffer(ROWS, COLUMNS), most_triangles=budget)
    return 1e3 * float(
        np.median([seconds(lambda one=one: culler.cull(one)) for one in path.cameras])
    )


def shared_scene() -> tuple[Path, CameraPath]:
    """Lyon, built where it is not there, and a walk in its streets."""
    one, folder = SCENES[0], WORK / SCENES[0].name
    scene, packed = one.load(), folder / "scene.occs"
    if not packed.exists():
        source = WORK / f"{one.name}.glb"
        WORK.mkdir(parents=True, exist_ok=True)
        write_scene(scene, source)
        command = [sys.executable, "-m", "simplifier", "scene", str(source), "-o", str(folder)]
        subprocess.run([*command, *one.options], check=True)
    return packed, generate_path(scene, PathOptions("street", FRAMES, one.up))


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, tell and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", choices=("raster", "walk"))
    parser.add_argument("--scene", type=Path, help="an .occs file")
    parser.add_argument("--path", type=Path, help="cameras through it")
    parser.add_argument("--out", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    if (given.scene is None) != (given.path is None):
        parser.error("--scene and --path go together")
    if shutil.which(os.environ.get("CC") or "cc") is None:
        sys.exit("there is no C compiler here: install one, or name it in CC")
    with tempfile.TemporaryDirectory() as name:
        for part in ("raster", "walk"):
            if given.only not in (None, part):
                continue
            if part == "raster":
                rows = raster_rows(Path(name))
            elif given.scene is not None:
                rows = walk_rows(Path(name), given.scene, load_camera_path(given.path))
            else:
                rows = walk_rows(Path(name), *shared_scene())
            measured = []
            for row in rows:
                print(f"{part}: {told(row)}", flush=True)
                measured.append(row)
            write_table(given.out / f"engine_{part}.csv", measured, "python -m bench.engine")
    print(write_page(given.out, "engine", ("raster", "walk")))


if __name__ == "__main__":
    main()
