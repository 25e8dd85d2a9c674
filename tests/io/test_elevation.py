"""Elevation models: arrays and GeoTIFF files as they are, and refusals of all else."""

from __future__ import annotations

import io
import sys

import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from simplifier.errors import (
    EmptyMeshError,
    MemoryLimitError,
    OccluderError,
    OptionError,
    UnknownFormatError,
    UnreadableMeshError,
)
from simplifier.io.elevation import load_elevation

SPACING = (30.0, 20.0)
HEIGHTS = np.arange(12.0).reshape(3, 4)
FLOATS = HEIGHTS.astype(np.float32)
SHARED = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def saved(tmp_path, values, **how):
    path = tmp_path / "posts.npy"
    np.save(path, values, **how)
    return path


def geotiff(tmp_path, values=FLOATS, scale=(30.0, 20.0, 0.0),
            ties=(0.0, 0.0, 0.0, 1000.0, 2000.0, 0.0), tags=(), **how):  # fmt: skip
    """A file of one band with the given tags; None leaves one out."""
    path = tmp_path / "posts.tif"
    extra = [(33550, "d", 3, scale, True)] if scale else []
    extra += [(33922, "d", len(ties), ties, True)] if ties else []
    tifffile.imwrite(path, values, extratags=[*extra, *tags], metadata=None, **how)
    return path


@pytest.mark.parametrize("dtype", ["i1", "u1", "<i2", ">i2", "<u4", ">i8", "f2", "<f4", ">f8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_of_all_numbers_are_read_in_the_order_of_their_rows(tmp_path, dtype, order):
    values = np.asarray(HEIGHTS, dtype=dtype, order=order)
    read = load_elevation(saved(tmp_path, values), spacing=SPACING)
    assert read.heights.dtype == np.float64
    assert np.array_equal(read.heights, HEIGHTS)
    assert (read.spacing, read.origin) == (SPACING, (0.0, 40.0))
    assert not read.heights.flags.writeable


@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_versions_of_the_header(tmp_path, version):
    path = tmp_path / "posts.npy"
    with path.open("wb") as file:
        np.lib.format.write_array(file, HEIGHTS, version=version)
    assert np.array_equal(load_elevation(path, spacing=SPACING).heights, HEIGHTS)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros((0, 4)), "0 x 4 posts"),
        (np.zeros((1, 4)), "1 x 4 posts"),
        (np.zeros((4, 1)), "4 x 1 posts"),
        (np.zeros(4), "1 axes"),
        (np.zeros((2, 2, 2)), "3 axes"),
        (np.array(3.0), "0 axes"),
        (np.zeros((3, 3), complex), "complex128"),
        (np.zeros((3, 3), bool), "bool"),
        (np.zeros((3, 3), "U2"), "'<U2'"),
        (np.zeros((3, 3), "M8[s]"), "datetime64"),
        (np.zeros((3, 3), "f4,i2"), "not numbers"),
        (np.array([[0.0, np.inf], [0.0, 0.0]]), "1 height is infinite"),
        (np.array([[0.0, 2e30], [0.0, 0.0]]), "1e+30 or more"),
    ],
)
def test_arrays_that_are_no_posts_are_refused(tmp_path, values, words):
    path = saved(tmp_path, values)
    with pytest.raises(UnreadableMeshError) as caught:
        load_elevation(path, spacing=SPACING)
    assert words in str(caught.value)
    assert caught.value.where == str(path)
    assert caught.value.remedy


def test_an_array_without_four_known_neighbours_is_empty(tmp_path):
    holes = HEIGHTS.copy()
    holes[1] = np.nan
    path = saved(tmp_path, holes)
    with pytest.raises(EmptyMeshError, match="no four neighbouring posts are known"):
        load_elevation(path, spacing=SPACING)
    some = HEIGHTS.copy()
    some[0, 0] = np.nan
    read = load_elevation(saved(tmp_path, some), spacing=SPACING)
    assert read.missing == 1
    assert read.squares.sum() == 5


class Trap:
    """Whose unpickling would leave a word."""

    def __reduce__(self):
        return sys.exit, ("unpickled",)


def test_a_pickle_is_never_opened(tmp_path):
    path = saved(tmp_path, np.array([[Trap(), 1], [2, 3]], dtype=object), allow_pickle=True)
    with pytest.raises(UnreadableMeshError, match="object"):
        load_elevation(path, spacing=SPACING)


def test_a_header_that_claims_more_than_there_is_makes_no_room(tmp_path):
    path = tmp_path / "posts.npy"
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**7)}
    )
    path.write_bytes(buffer.getvalue() + bytes(100))
    with pytest.raises(UnreadableMeshError, match="ends early"):
        load_elevation(path, spacing=SPACING)


def test_spacing_is_two_lengths_and_wanted_of_arrays(tmp_path):
    path = saved(tmp_path, HEIGHTS)
    with pytest.raises(OptionError, match="give the spacing, DX,DY in world units"):
        load_elevation(path)
    for wrong in ((1.0,), (1.0, 2.0, 3.0), (0.0, 1.0), (-1.0, 1.0), (np.nan, 1.0), (1e200, 1.0)):
        with pytest.raises(OptionError, match="spacing"):
            load_elevation(path, spacing=wrong)


def test_what_would_need_too_much_memory_is_refused_before(tmp_path):
    path = saved(tmp_path, np.zeros((400, 400), np.int16))
    with pytest.raises(MemoryLimitError, match="memory limit of at least"):
        load_elevation(path, spacing=SPACING, memory_limit=0.01)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "posts.asc").write_text("ncols 3")
    with pytest.raises(UnknownFormatError, match=r"\.npy"):
        load_elevation(tmp_path / "posts.asc", spacing=SPACING)
    for name in ("none.npy", "none.tif"):
        with pytest.raises(UnreadableMeshError, match="no such file"):
            load_elevation(tmp_path / name, spacing=SPACING)
        (tmp_path / name).mkdir()
        with pytest.raises(UnreadableMeshError, match="folder"):
            load_elevation(tmp_path / name, spacing=SPACING)


@SHARED
@given(data=st.data())
def test_a_damaged_array_is_read_or_refused(tmp_path, data):
    path = saved(tmp_path, HEIGHTS)
    spoil(path, data)
    read_or_refused(path)


@SHARED
@given(data=st.data(), compressed=st.booleans())
def test_a_damaged_geotiff_is_read_or_refused(tmp_path, data, compressed):
    path = geotiff(tmp_path, compression="zlib" if compressed else None)
    spoil(path, data)
    read_or_refused(path)


def spoil(path, data):
    """Change some bytes of a file, or cut it."""
    held = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        del held[data.draw(st.integers(0, len(held) - 1)) :]
    else:
        for _ in range(data.draw(st.integers(1, 4))):
            held[data.draw(st.integers(0, len(held) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(held)


def read_or_refused(path):
    try:
        read = load_elevation(path, spacing=SPACING, memory_limit=1.0)
    except OccluderError:
        return
    assert not np.isinf(read.heights).any()
    assert min(read.heights.shape) >= 2


@SHARED
@given(values=arrays.arrays(
    st.sampled_from([np.int16, np.uint8, np.float32, np.float64]),
    arrays.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=5),
    elements=st.integers(0, 100),
))  # fmt: skip
def test_both_formats_tell_the_same_heights(tmp_path, values):
    ours = load_elevation(saved(tmp_path, values), spacing=SPACING)
    other = load_elevation(geotiff(tmp_path, values, compression="zlib"))
    assert np.array_equal(ours.heights, other.heights)
    assert ours.spacing == other.spacing


# GeoTIFF.


def keys(**values):
    """GeoKeyDirectoryTag: model type and raster type."""
    names = {"model": 1024, "raster": 1025}
    entries = [word for name, value in values.items() for word in (names[name], 0, 1, value)]
    numbers = (1, 1, 0, len(values), *entries)
    return (34735, "H", len(numbers), numbers, True)


def test_a_post_is_the_middle_of_its_pixel_or_its_corner(tmp_path):
    area = load_elevation(geotiff(tmp_path))
    assert (area.spacing, area.origin) == ((30.0, 20.0), (1015.0, 1990.0))
    point = load_elevation(geotiff(tmp_path, tags=[keys(model=1, raster=2)]))
    assert point.origin == (1000.0, 2000.0)
    shifted = geotiff(tmp_path, ties=(2.0, 1.0, 0.0, 1000.0, 2000.0, 0.0))
    assert load_elevation(shifted).origin == (955.0, 2010.0)
    given = load_elevation(geotiff(tmp_path), spacing=(3.0, 2.0))
    assert (given.spacing, given.origin) == ((3.0, 2.0), (1015.0, 1990.0))


@pytest.mark.parametrize("kind", ["i2", "f4", "f8"])
def test_rasterio_says_the_same(tmp_path, kind):
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "posts.tif"
    values = np.random.default_rng(0).integers(0, 99, (40, 50)).astype(kind)
    values[3, 4] = values[20:, 7] = -99
    place = rasterio.transform.from_origin(5000.0, 7000.0, 12.5, 10.0)
    with rasterio.open(
        path, "w", driver="GTiff", width=50, height=40, count=1, dtype=values.dtype, nodata=-99,
        transform=place, compress="deflate", tiled=True, blockxsize=16, blockysize=16,
    ) as file:  # fmt: skip
        file.write(values, 1)
    read = load_elevation(path)
    with rasterio.open(path) as file:
        expected = file.read(1, masked=True).astype(np.float64).filled(np.nan)
        assert read.origin == file.xy(0, 0)
    assert np.array_equal(read.heights, expected, equal_nan=True)
    assert read.missing == 21
    assert read.spacing == (12.5, 10.0)


def test_nodata_as_text_is_the_number_that_the_file_stores(tmp_path):
    values = FLOATS.copy()
    values[0, 0] = np.finfo(np.float32).min
    path = geotiff(tmp_path, values, tags=[(42113, "s", 0, "-3.40282346638528860e+38", True)])
    assert load_elevation(path).missing == 1
    values[0, 0] = np.nan
    assert load_elevation(geotiff(tmp_path, values)).missing == 1
    wrong = geotiff(tmp_path, tags=[(42113, "s", 0, "none", True)])
    with pytest.raises(UnreadableMeshError, match="'none' is not a value of missing samples"):
        load_elevation(wrong)


def transform(*rows):
    numbers = (*rows, *(0.0,) * (12 - len(rows)), 0.0, 0.0, 0.0, 1.0)
    return (34264, "d", 16, numbers, True)


def test_a_matrix_without_rotation_is_a_place(tmp_path):
    path = geotiff(tmp_path, scale=None, ties=None, tags=[
        transform(30.0, 0.0, 0.0, 1000.0, 0.0, -20.0, 0.0, 2000.0)
    ])  # fmt: skip
    read = load_elevation(path)
    assert (read.spacing, read.origin) == ((30.0, 20.0), (1015.0, 1990.0))


@pytest.mark.parametrize(
    ("how", "kind", "words"),
    [
        ({"scale": None, "ties": None, "tags": [
            transform(30.0, 5.0, 0.0, 1000.0, -5.0, -20.0, 0.0, 2000.0)]},
         UnreadableMeshError, "rotated"),
        ({"scale": None, "ties": None, "tags": [
            transform(30.0, 0.0, 0.0, 1000.0, 0.0, 20.0, 0.0, 2000.0)]},
         UnreadableMeshError, "north to south"),
        ({"ties": (0.0,) * 12}, UnreadableMeshError, "2 tiepoints"),
        ({"scale": None}, UnreadableMeshError, "without a scale"),
        ({"scale": (np.nan, 1.0, 0.0)}, UnreadableMeshError, "place of its grid is damaged"),
        ({"scale": (0.0, 1.0, 0.0)}, UnreadableMeshError, "0 and 1 apart"),
        ({"scale": None, "ties": None}, OptionError, "does not say how far apart"),
        ({"tags": [keys(model=2)]}, OptionError, "degrees apart"),
        ({"values": np.zeros((3, 4, 3), np.uint8), "photometric": "rgb"},
         UnreadableMeshError, "3 bands"),
        ({"values": np.zeros((2, 3, 4), np.float32), "photometric": "minisblack"},
         UnreadableMeshError, "several images"),
        ({"values": np.zeros((3, 4), np.complex64)}, UnreadableMeshError, "complex64"),
        ({"values": np.zeros((1, 4), np.int16)}, UnreadableMeshError, "1 x 4 posts"),
        ({"tags": [(42112, "s", 0, '<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.1'
                    "</Item></GDALMetadata>", True)]}, UnreadableMeshError, "scale of 0.1"),
    ],
)  # fmt: skip
def test_geotiff_files_that_are_not_supported_are_refused(tmp_path, how, kind, words):
    path = geotiff(tmp_path, **how)
    with pytest.raises(kind) as caught:
        load_elevation(path)
    assert words in str(caught.value)
    assert caught.value.remedy


def test_degrees_are_read_with_a_spacing(tmp_path):
    path = geotiff(tmp_path, scale=(0.001, 0.001, 0.0), tags=[keys(model=2)])
    read = load_elevation(path, spacing=SPACING)
    assert (read.spacing, read.origin) == (SPACING, (0.0, 40.0))


def test_overviews_are_passed_over(tmp_path):
    path = tmp_path / "posts.tif"
    with tifffile.TiffWriter(path) as file:
        scale = [(33550, "d", 3, (1.0, 1.0, 0.0), True), (33922, "d", 6, (0.0,) * 6, True)]
        file.write(HEIGHTS, extratags=scale, metadata=None)
        file.write(HEIGHTS[::2, ::2], subfiletype=1, metadata=None)
    assert np.array_equal(load_elevation(path).heights, HEIGHTS)


def test_a_compression_without_its_package_says_how_to_go_on(tmp_path):
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "posts.tif"
    with rasterio.open(path, "w", driver="GTiff", width=4, height=3, count=1, dtype="float32",
                       compress="lzw") as file:  # fmt: skip
        file.write(FLOATS, 1)
    try:
        import imagecodecs  # noqa: F401
    except ImportError:
        with pytest.raises(UnreadableMeshError, match=r"planar-occluder\[geotiff\]"):
            load_elevation(path, spacing=SPACING)
    else:
        assert np.array_equal(load_elevation(path, spacing=SPACING).heights, HEIGHTS)
