"""Elevation models: arrays of heights (``.npy``) and GeoTIFF files (``.tif``, ``.tiff``).

A GeoTIFF says where its posts are (OGC 19-008r4, GeoTIFF 1.1): ``ModelPixelScaleTag`` and
``ModelTiepointTag``, or a ``ModelTransformationTag`` without rotation; by ``GTRasterTypeGeoKey`` a
post is the middle of its pixel or the corner.  ``GDAL_NODATA`` is the value of missing samples.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import as_path, check_lengths
from simplifier.errors import OccluderError, OptionError, UnknownFormatError, UnreadableMeshError
from simplifier.geometry.elevation import Elevation
from simplifier.geometry.mesh import FloatArray
from simplifier.io.files import read_bytes
from simplifier.io.suffixes import ELEVATION_SUFFIXES
from simplifier.memory.limit import check_need
from simplifier.memory.need import MemoryNeed

_NAME_ONE = "name an elevation model"
_POST = 34  # bytes: float64 heights, a copy, what is known of them, and what is looked at of that

Spacing = tuple[float, float]


def load_elevation(
    path: str | Path,
    *,
    spacing: tuple[float, ...] | None = None,
    memory_limit: float | None = None,
) -> Elevation:
    """The posts of a file; of an array the south-west one is at the world's origin.

    ``spacing``       between posts along x and y, world units; a GeoTIFF has its own.
    ``memory_limit``  GiB, half of the machine's by default.

    Raises :class:`UnreadableMeshError` for a file that is missing, damaged or not supported,
    :class:`EmptyMeshError` where no four neighbouring posts are known, :class:`OptionError` for a
    spacing that is missing or no two lengths, :class:`UnknownFormatError` and
    :class:`MemoryLimitError`.
    """
    path = as_path("path", path)
    wanted = _spacing(spacing)
    suffix = path.suffix.lower()
    try:
        if suffix == ".npy":
            return _from_array(path, wanted, memory_limit)
        if suffix in ELEVATION_SUFFIXES:
            return _from_geotiff(path, wanted, memory_limit)
    except OccluderError as error:
        if error.where:
            raise
        raise type(error)(error.what, where=str(path), remedy=error.remedy) from None
    raise UnknownFormatError(
        f"'{path.suffix}' is not a suffix of an elevation model", where=str(path),
        remedy=f"name a file that ends in one of {' '.join(ELEVATION_SUFFIXES)}",
    )  # fmt: skip


def _spacing(given: tuple[float, ...] | None) -> Spacing | None:
    if given is None:
        return None
    check_lengths("spacing", given)
    if len(given) != 2 or not all(1e-100 < one < 1e100 for one in given):
        raise OptionError(
            f"{','.join(f'{one:g}' for one in given)} are no two lengths", where="spacing",
            remedy="give DX,DY, the world units between posts",
        )  # fmt: skip
    return float(given[0]), float(given[1])


def _check_room(shape: tuple[int, ...], held: int, memory_limit: float | None, where: str) -> None:
    need = held + _POST * math.prod(shape)
    check_need(MemoryNeed({"load": need}), memory_limit, where=where)


def _check_numbers(dtype: np.dtype[Any] | None) -> None:
    if dtype is None or dtype.kind not in "iuf":
        kind = "an unknown kind" if dtype is None else f"kind '{dtype}'"
        raise UnreadableMeshError(
            f"its values are of {kind}, not numbers that can be heights",
            remedy="write integers or floats",
        )


# Arrays.


def _from_array(path: Path, spacing: Spacing | None, memory_limit: float | None) -> Elevation:
    if spacing is None:
        raise OptionError(
            "an array does not say how far apart its posts are", where="spacing",
            remedy="give the spacing, DX,DY in world units",
        )  # fmt: skip

    def check(start: bytes, size: int) -> None:
        shape, _, dtype, begin = _array_header(start)
        _check_numbers(dtype)
        if len(shape) != 2:
            raise UnreadableMeshError(
                f"it has {len(shape)} axes", remedy="write one height for each row and column"
            )
        if begin + math.prod(shape) * dtype.itemsize > size:
            raise UnreadableMeshError("it ends early: its heights are not all there")
        _check_room(shape, size, memory_limit, str(path))

    data = read_bytes(path, remedy=_NAME_ONE, check_start=check)
    shape, fortran, dtype, begin = _array_header(data)
    values = np.frombuffer(data, dtype, math.prod(shape), begin)
    heights = np.array(values.reshape(shape, order="F" if fortran else "C"), np.float64, order="C")
    return Elevation(heights, spacing, (0.0, (shape[0] - 1) * spacing[1]))


def _array_header(data: bytes) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """Shape, whether columns come first, kind of value, and where the values begin."""
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        if version == (1, 0):
            shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
        elif version == (2, 0):
            shape, fortran, dtype = np.lib.format.read_array_header_2_0(file)
        else:
            raise ValueError(f"version {version[0]}.{version[1]} is not known")
        if any(length < 0 for length in shape):
            raise ValueError("a length is negative")
    except Exception as error:  # a header is Python's text: any of its errors
        raise UnreadableMeshError(f"this is not an array of numpy ({error})") from None
    return shape, fortran, dtype, file.tell()


# GeoTIFF.

_PIXEL_SCALE, _TIEPOINTS, _TRANSFORM, _GEO_KEYS = 33550, 33922, 34264, 34735
_METADATA, _NODATA = 42112, 42113
_WANTED = (_PIXEL_SCALE, _TIEPOINTS, _TRANSFORM, _GEO_KEYS, _METADATA, _NODATA)
_MODEL_TYPE, _RASTER_TYPE = 1024, 1025
_GEOGRAPHIC, _POINT = 2, 2
_CONVERT = "convert it: gdal_translate -co COMPRESS=DEFLATE -co PREDICTOR=1 IN OUT.tif"
_ITEM = re.compile(r"<Item([^<>]*)>([^<]*)<")
_SCALED = re.compile(r'role="(scale|offset)"')


def _from_geotiff(path: Path, spacing: Spacing | None, memory_limit: float | None) -> Elevation:
    # Imported where it is used: most scenes are no elevation models.
    import tifffile

    logging.getLogger("tifffile").addHandler(logging.NullHandler())
    data = read_bytes(path, remedy=_NAME_ONE)
    try:
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            page = cast(Any, file.pages[0])
            # Not all tags: they may share their bytes, so that all hold more than the file does.
            tags = {code: page.tags[code].value for code in _WANTED if code in page.tags}
            _check_page(page, file.pages[1:], len(data))
            shape = int(page.imagelength), int(page.imagewidth)
            _check_room(shape, len(data), memory_limit, str(path))
            pitch, origin = _place(tags, shape, spacing)
            values = page.asarray()
    except OccluderError:
        raise
    except Exception as error:  # a damaged file: whatever the reader trips over
        if "imagecodecs" in str(error):
            raise UnreadableMeshError(
                f"its compression, {page.compression.name}, needs the package imagecodecs",
                remedy=f"install planar-occluder[geotiff], or {_CONVERT}",
            ) from None
        raise UnreadableMeshError(f"this is not a TIFF that can be read ({error})") from None
    if values.shape != shape:
        raise UnreadableMeshError(f"it has {values.shape} values, not rows and columns")
    return Elevation(_without_missing(values, tags.get(_NODATA)), pitch, origin)


def _check_page(page: Any, others: Any, size: int) -> None:
    """Refuse what is no single band of heights, and what is not all there."""
    bands = int(page.samplesperpixel) * int(page.imagedepth)
    if bands != 1:
        raise UnreadableMeshError(
            f"it has {bands} bands, and an elevation model has one",
            remedy="take one: gdal_translate -b 1 IN OUT.tif",
        )
    for other in others:
        if other.is_mask:
            raise UnreadableMeshError(
                "it has a mask, which is not supported",
                remedy="write a value for missing samples: gdal_translate -mask none -a_nodata",
            )
        if not other.is_reduced:
            raise UnreadableMeshError("it holds several images", remedy="write one of them alone")
    _check_numbers(page.dtype)
    ends = np.add(page.dataoffsets, page.databytecounts, dtype=object)
    if len(ends) == 0 or max(ends) > size:
        raise UnreadableMeshError("it ends early: its heights are not all there")


def _place(
    tags: Mapping[int, Any], shape: tuple[int, int], spacing: Spacing | None
) -> tuple[Spacing, tuple[float, float]]:
    """The spacing of the posts, and x and y of the first.

    Raises for a grid that is turned, sheared or given by several points.
    """
    keys = _geo_keys(tags.get(_GEO_KEYS))
    geographic = keys.get(_MODEL_TYPE) == _GEOGRAPHIC
    if geographic and spacing is None:
        raise OptionError(
            "its posts are degrees apart, and its heights are lengths", where="spacing",
            remedy="give the spacing, DX,DY in the unit of heights, or project it: gdalwarp -t_srs",
        )  # fmt: skip
    for attributes, value in _ITEM.findall(str(tags.get(_METADATA, ""))):
        role = _SCALED.search(attributes)
        name = role[1] if role else ""
        if name and float(value) != (1.0 if name == "scale" else 0.0):
            raise UnreadableMeshError(
                f"its values have a {name} of {value.strip()}, which is not supported",
                remedy="write heights: gdal_translate -unscale -ot Float32 IN OUT.tif",
            )
    found = _grid(tags)
    if found is None and spacing is None:
        raise OptionError(
            "the file does not say how far apart its posts are", where="spacing",
            remedy="give the spacing, DX,DY in world units",
        )  # fmt: skip
    if found is None or geographic:
        assert spacing is not None
        return spacing, (0.0, (shape[0] - 1) * spacing[1])
    (dx, dy), (x, y) = found
    within = 0.0 if keys.get(_RASTER_TYPE) == _POINT else 0.5
    origin = (x + within * dx, y - within * dy)
    return (dx, dy) if spacing is None else spacing, origin


def _grid(tags: Mapping[int, Any]) -> tuple[Spacing, tuple[float, float]] | None:
    """The pitch of pixels and the place of pixel (0, 0) in the model; None where it has none."""
    if _TRANSFORM in tags:
        matrix = _numbers(tags[_TRANSFORM], 16).reshape(4, 4)
        (dx, right), (down, dy), x, y = matrix[0, :2], matrix[1, :2], matrix[0, 3], matrix[1, 3]
        if right != 0.0 or down != 0.0:
            raise UnreadableMeshError(
                "its grid is rotated, which is not supported",
                remedy="turn it north up: gdalwarp IN OUT.tif",
            )
        pitch, place = (dx, -dy), (x, y)
    elif _PIXEL_SCALE in tags:
        scale, ties = _numbers(tags[_PIXEL_SCALE], 3), np.ravel(tags.get(_TIEPOINTS, ()))
        if len(ties) != 6:
            raise UnreadableMeshError(
                f"its grid has {len(ties) // 6} tiepoints, and only one is supported",
                remedy="fit it to a grid: gdalwarp IN OUT.tif",
            )
        column, row, _, x, y, _ = _numbers(ties, 6)
        pitch, place = (scale[0], scale[1]), (x - column * scale[0], y + row * scale[1])
    elif _TIEPOINTS in tags:
        raise UnreadableMeshError(
            "it has tiepoints without a scale, which is not supported",
            remedy="fit it to a grid: gdalwarp IN OUT.tif",
        )
    else:
        return None
    if not (1e-100 < pitch[0] < 1e100 and 1e-100 < pitch[1] < 1e100):
        raise UnreadableMeshError(
            f"its posts are {pitch[0]:g} and {pitch[1]:g} apart: it does not run from north to"
            " south and west to east",
            remedy="turn it north up: gdalwarp IN OUT.tif",
        )
    return (float(pitch[0]), float(pitch[1])), (float(place[0]), float(place[1]))


def _numbers(values: Any, count: int) -> FloatArray:
    numbers = np.asarray(values, dtype=np.float64).ravel()
    if len(numbers) < count or not np.isfinite(numbers).all():
        raise UnreadableMeshError("the place of its grid is damaged")
    return numbers[:count]


def _geo_keys(directory: Any) -> dict[int, int]:
    """The keys whose values are in the directory itself."""
    if directory is None:
        return {}
    numbers = np.ravel(directory)
    entries = numbers[4 : 4 + len(numbers[4:]) // 4 * 4].reshape(-1, 4)
    return {int(key): int(value) for key, place, _, value in entries if place == 0}


def _without_missing(values: NDArray[Any], nodata: Any) -> FloatArray:
    """As heights, NaN where the value is the one of missing samples."""
    heights = np.array(values, dtype=np.float64, order="C")
    if nodata is None:
        return heights
    try:
        value = float(str(nodata).strip().strip("\0"))
    except ValueError:
        raise UnreadableMeshError(
            f"'{nodata}' is not a value of missing samples", remedy="write it anew"
        ) from None
    # As the file stores heights: -3.4e38 as text is another number than the float32 that is meant.
    if values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            value = float(np.asarray(value).astype(values.dtype))
    heights[heights == value] = np.nan
    return heights
