"""MemoryNeed: the peak of a run before it begins, by stage.

Bytes that each stage holds at once, from the sizes that it works on.

Every figure says which arrays it stands for.  n vertices, m triangles, V voxels; float64 and int64
take 8 bytes, int32 4, bool 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from simplifier.kernels.coverage import VIEWS_AT_A_TIME, by_contours
from simplifier.kernels.sight import picture_size
from simplifier.kernels.threads import thread_count
from simplifier.options.stages import Options, SectionOptions, SolidOptions, fineness

GIB = 1 << 30
MIB = 1 << 20

BASE_BYTES = 110 * MIB
"""Of a process that has done nothing yet: interpreter, libraries, and the kernels' machine code.
The first run on a machine compiles them in other processes, a few hundred MiB each."""


@dataclass(frozen=True)
class MemoryNeed:
    """Bytes that a run holds at once, beside :data:`BASE_BYTES`, by stage in the order of the run.

    Each stage counts what earlier ones have left for later ones.  At least one stage.
    """

    stages: Mapping[str, int]

    @property
    def largest(self) -> str:
        """The stage that needs most, the first of equals."""
        return max(self.stages, key=lambda name: self.stages[name])

    @property
    def peak(self) -> int:
        """Bytes of the whole process in that stage."""
        return BASE_BYTES + self.stages[self.largest]

    @property
    def gib(self) -> float:
        """The peak in GiB."""
        return self.peak / GIB

    def beside(self, held: int) -> MemoryNeed:
        """The same where so many bytes are held by others all the while."""
        return MemoryNeed({name: held + count for name, count in self.stages.items()})

    def joined(self, other: MemoryNeed) -> MemoryNeed:
        """Of a run that does this and then the other; the larger where both have a stage."""
        both = dict(self.stages)
        for name, count in other.stages.items():
            both[name] = max(count, both.get(name, 0))
        return MemoryNeed(both)


Shape = tuple[int, int, int]

_VERTEX = 24  # three float64
_FACE = 12  # three int32
_TABLE_FACE = 120  # its three edges while they are paired; then less, with its plane and sides
_KEPT_FACE = 52  # three halves of an edge, its plane, its corners
_CLUSTER_FACE = 38  # its corners once more in float32, and a box for sixteen
_CROSSINGS = 8 * MIB  # of some views at a time
_READ_FACE = 24  # three int64, as codecs give them
_BLOCK = 40 * MIB  # of triangles that are checked at once, with their corners and edges

_KERNELS = 25 * MIB  # compiled code of what makes an occluder, and small arrays
_STARTS = 15 * MIB  # two decimations of at most 64 cells a side
_CRACKS = 28 * MIB  # who stands for the vertices of each of 192 cells a side
_DRAWING = 100 * MIB  # matplotlib, OpenCV and fonts; six views of 1024 x 1024 pixels
_MASKS = 64 * MIB  # of views that are held at once; at least four
_MASK_VIEWS = 4
_MASKS_KEPT = 16 * MIB  # at most, of one size
_FRONT_IMAGE = 256  # pixels a side
_REPORT_VIEWS, _REPORT_IMAGE = 64, 128  # of the occlusion measure
_OVERHANG_IMAGE = 514  # pixels a side, where the occluder stays within the mesh's sphere
_VIEWING_TRIANGLES = 300_000  # meshes of more are thinned to be looked at

_FLOOR = 0.06  # the finest voxel in which floors are found, eye heights
_MOST_FLOOR = 27_000_000  # of these voxels
_FLOOR_VOXEL = 12  # bytes of each: touched, free, who stands there, which space it is, the places
_NEAR = 128.0  # voxels of each row that are near a surface: twelve each time it is crossed
_PLANES = 16  # of the interior that are looked at together
_IMAGE = 512  # bytes of 64 x 64 bits
_FEW = 64  # triangles that any start is filled up to
_POLYGON = 40  # triangles of a section's polygon, more or less: copies fill a search to twice that
_SHEET = 60_000  # triangles of a surface in 64 cells a side


@dataclass(frozen=True)
class MeshSize:
    """Of a mesh in memory."""

    vertices: int
    triangles: int

    @property
    def held(self) -> int:
        """Bytes of the mesh itself."""
        return _VERTEX * self.vertices + _FACE * self.triangles


def load(vertices: int, triangles: int, decoding: int) -> int:
    """``decoding`` bytes until the codec is done; then its arrays are checked and copied."""
    read = _VERTEX * vertices + _READ_FACE * triangles
    # Which vertices are used (bool), their new numbers (int32), which triangles are kept (bool).
    checking = (1 + 4) * vertices + triangles + _BLOCK
    return max(decoding, read + checking + MeshSize(vertices, triangles).held)


def voxelize(shape: Shape) -> int:
    """The grid; and grown by a dilation at most."""
    return math.prod(shape)


def finer(shape: Shape, options: Options) -> int:
    """What is touched in voxels of the room, from which the grid is made, until there is a room."""
    size = fineness(max(shape)) if options.marks_finely else 1
    return size**3 * math.prod(shape) if size > 1 else 0


def fill(shape: Shape, options: SolidOptions, hole_voxels: float, shrink_voxels: float) -> int:
    """What is touched and the flood: free voxels, what is reached as bool and turned, as bits."""
    voxels = math.prod(shape)
    most = 4.5 * voxels
    if options.glue:
        most = max(most, 4.0 * _grown(shape, 2))
    if hole_voxels > 0.0:
        # Distances (int32) and two solids, in free space around; what is touched and filled.
        most = max(most, 6.0 * _grown(shape, _hole_margin(hole_voxels)) + 2.0 * voxels)
    if options.by_sight:
        # Touched, filled, free, near the surface, unseen and outermost (bool); of each that is free
        # and near, its place (three int16) and from how many sides it is seen (uint16).
        pictures = 8 * 8 * picture_size(shape) ** 2
        near = min(1.0, _NEAR / max(shape))
        most = max(most, (6.0 + 8.0 * near) * voxels + pictures)
    if options.wholly_inside:
        most = max(most, 3.0 * voxels)
        if shrink_voxels > 0.0:
            most = max(most, 6.0 * _grown(shape, 1) + 3.0 * voxels)
    return int(most)


def walk(size: MeshSize, shape: Shape, eye_voxels: float) -> int:
    """What is touched and filled; the mesh upright; and the voxels in which floors are found."""
    across = [1.0 / (_FLOOR * eye_voxels) * length for length in shape]
    headroom = 3.0 / _FLOOR  # above each way that may be up
    voxels = min(math.prod(one + headroom for one in across), _MOST_FLOOR)
    return 3 * math.prod(shape) + 2 * size.held + int(_FLOOR_VOXEL * voxels)


def _hole_margin(hole_voxels: float) -> int:
    return math.ceil(math.sqrt(hole_voxels * hole_voxels + 1.0) / 2.0) + 2


def _grown(shape: Shape, margin: int) -> int:
    """Voxels with a margin around."""
    return math.prod(length + 2 * margin for length in shape)


def solid(shape: Shape, options: Options) -> int:
    """What stays of it until the report: touched, filled, and the core where it is another."""
    kept = 3 if options.solid.wholly_inside else 2
    return kept * math.prod(shape) + _inner(shape, options)


def _inner(shape: Shape, options: Options) -> int:
    """The interior in finer voxels, where there is one."""
    size = _inner_fineness(shape, options)
    return size**3 * math.prod(shape) if size > 1 else 0


def _inner_fineness(shape: Shape, options: Options) -> int:
    """Voxels of the interior to a cell along each axis: of a sheet, which it may be, finer ones."""
    if options.solid.wholly_inside:
        return fineness(max(shape), inside=True) if options.solid.shrink == 0.0 else 1
    return fineness(max(shape)) if options.fine_room else 1


def sections(shape: Shape, options: SectionOptions) -> int:
    """The solid as bytes with a layer around, and the best slice (bool) of each bin."""
    a, b, c = shape
    slices = (options.directions + 3) * options.depths
    # The mean over all directions of a frame about the box's outline is 3/4 of its six sides' half.
    return _KERNELS + _grown(shape, 1) + int(slices * 0.75 * (a * b + b * c + c * a))


def surface(shape: Shape) -> int:
    """The voxel mesh for OpenGL: faces of a convex solid as lattice corners, keys and vertices."""
    a, b, c = shape
    return 2 * (a * b + b * c + c * a) * (3 * 96 + 64) + 3 * math.prod(shape)


def refine(size: MeshSize, shape: Shape, options: Options) -> int:
    """The room; then the mesh's place in the grid, beside the sections that are cut meanwhile, or
    the pictures of the searches."""
    reach = 0 if options.solid.wholly_inside or options.solid.glue else 1
    allowed = _grown(shape, reach + 1)
    growing = 3 * allowed  # the dilation copies twice
    inside = options.solid.wholly_inside and options.solid.shrink == 0.0
    if inside or (reach and options.fine_room):
        allowed, growing = _fine_room(shape, options)
        growing += finer(shape, options)
    # Placed vertices, the cell of each, and a copy of the faces.
    placing = (_VERTEX + 4) * size.vertices + _FACE * size.triangles
    # Where there may be cracks: who is in each cell, where these begin, and who is on a border.
    placing += (4 + 4 + 1) * size.vertices + _CRACKS
    fixed = _KERNELS + (_STARTS if options.refine.decimated else 0)
    if options.refine.moves == 0 and options.time_limit is None:
        return fixed + (0 if reach else growing)
    if options.time_limit is None and thread_count() > 1:
        placing += sections(shape, options.sections) - _KERNELS
    return fixed + max(growing, allowed + max(placing, _searches(size, options)))


def _fine_room(shape: Shape, options: Options) -> tuple[int, int]:
    """The voxels and what is known of each cell; and with that what both are made of: cells that
    are touched and filled, a queue of the voxels in cells of the surface, and a layer's."""
    inside = options.solid.wholly_inside
    # Layers of two diagonals of a cell, as of a sheet, lie in three cells around; and one more.
    margin = 1 if inside else 4
    size, cells = fineness(max(shape), inside), _grown(shape, margin)
    a, b, c = shape
    surface = 2 * (a * b + b * c + c * a)
    held = size**3 * cells + (3 if size > 1 else 1) * cells
    waiting = 5 * (size**3 if size > 1 else 0) * surface
    return held, held + 2 * cells + waiting + 24 * size**2 * surface


def _searches(size: MeshSize, options: Options) -> int:
    """A picture of each triangle in each view, an eighth of that for groups; of each search, and
    of one that is judged beside them."""
    budget, bins = options.selection.budget, options.sections
    start = (bins.directions + 3) * bins.depths * _POLYGON
    if options.refine.decimated:
        start = max(start, min(size.triangles, _SHEET))
    count = min(budget, max(_FEW, 2 * start))
    pictures = count * options.refine.views * _IMAGE * 9 // 8
    if options.refine.front >= 1.0:
        return pictures * (options.refine.searches + 1)
    # Rows of what is in front, a quarter of a silhouette's; and depths of 64 x 64 pixels a view.
    depths = 4 * options.refine.views * 64 * _IMAGE // 8
    return pictures * 5 // 4 * (options.refine.searches + 1) + depths


def deviation(size: MeshSize, shape: Shape, options: Options) -> int:
    """The interior twice; a tree over the triangles, and one over the runs of the interior."""
    fine = _inner_fineness(shape, options)
    a, b, c = (fine * length for length in shape)
    leaves = 1 << math.floor(math.log2(max(size.triangles / 4.0, 1.0)))
    # Placed vertices; of each triangle its Morton key, which becomes its place; nodes of six.
    tree = _VERTEX * size.vertices + 8 * size.triangles + 96 * leaves
    # Interior, padded and its steps, a few planes at once; boxes and nodes of runs, two a column.
    runs = math.prod(shape) + 4 * _PLANES * b * c + 300 * a * b
    # What is not interior is gone before there is a tree.
    return max(2 * a * b * c, tree + runs)


def views(size: MeshSize, count: int, image: int, occluders: int) -> int:
    """Silhouettes of the mesh: vertices by axis, faces, of each thread the vertices on the screen
    and their pixels; masks as bits.  In many views a table of edges as well, and of each thread
    crossings and counts (int32), both twice, and which way triangles face."""
    drawn = _VERTEX * size.vertices + _FACE * size.triangles
    if by_contours(size.triangles, count, image**2):
        drawn += _TABLE_FACE * size.triangles + 2 * thread_count() * (_CROSSINGS + 4 * image**2)
    scratch = min(thread_count(), count) * (16 + 4) * size.vertices
    return drawn + scratch + _masks(count, image, occluders)


def remembered(size: MeshSize, count: int, image: int) -> int:
    """A copy of the mesh's vertices, and silhouettes in two sizes, which are kept while the next
    occluder of the mesh is made."""
    pictures = (_masks(count, one, 0) for one in (image, _OVERHANG_IMAGE))
    return _VERTEX * size.vertices + sum(min(kept, _MASKS_KEPT) for kept in pictures)


def quads(count: int, image: int, occluders: int) -> int:
    """Masks, and of each thread three moments a pixel; a sample needs less, and may turn out to be
    noise, so that all quads are counted after all."""
    table = 24 * image * image
    return min(thread_count(), count) * table + _masks(count, image, occluders)


def overhang(size: MeshSize, count: int, occluders: int) -> int:
    """Larger views, and of each thread how far each pixel is from the mesh's (int32)."""
    heights = min(thread_count(), count) * 4 * _OVERHANG_IMAGE**2
    return views(size, count, _OVERHANG_IMAGE, occluders) + heights


def front(size: MeshSize, count: int, occluders: int) -> int:
    """The mesh by axis, of each thread vertices on the screen and depths (float64).

    In many views also the mesh's copy and table of edges that a report keeps, with silhouettes in
    two sizes, and its clusters; of each thread the words of triangles, counts (int32), and of some
    views at a time crossings, depths and two bits a triangle.
    """
    drawn = _VERTEX * size.vertices + _FACE * size.triangles
    own = (16 + 4) * size.vertices + 8 * _FRONT_IMAGE**2
    if by_contours(size.triangles, count, _FRONT_IMAGE**2):
        drawn += 2 * _VERTEX * size.vertices + 2 * _MASKS_KEPT
        drawn += (_KEPT_FACE + _CLUSTER_FACE) * size.triangles
        own += 17 * size.triangles + _CROSSINGS + 4 * _FRONT_IMAGE**2
        own += VIEWS_AT_A_TIME * (size.triangles // 4 + 8 * _FRONT_IMAGE**2)
    return drawn + min(thread_count(), count) * own + _masks(count, _FRONT_IMAGE, occluders)


def _masks(count: int, image: int, occluders: int) -> int:
    """Bits of some views at a time."""
    view = (1 + occluders) * image * 8 * -(-image // 64)
    return min(count * view, max(_MASKS, _MASK_VIEWS * view))


def report(size: MeshSize) -> int:
    """The occlusion measure: views as bits, then as bool."""
    pixels = _REPORT_VIEWS * _REPORT_IMAGE * _REPORT_IMAGE
    return views(size, _REPORT_VIEWS, _REPORT_IMAGE, 1) + 4 * pixels


def pictures(size: MeshSize) -> int:
    """A few large views, smoothed, and put on a page."""
    return _DRAWING + views(size, 6, 1024, 1)


def viewing(size: MeshSize) -> int:
    """A thinned copy: of each vertex its cell, at worst one of its own, and a table of these; then
    the faces that are kept, and whether they are."""
    if size.triangles <= _VIEWING_TRIANGLES:
        return size.held
    return 92 * size.vertices + 24 * size.triangles
