"""Archives from anyone: nothing leads out of the folder, nothing is larger than allowed."""

from __future__ import annotations

import io
import stat
import zipfile
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engines.work.archive import unpack
from simplifier import UnreadableMeshError


def archive_of(folder, *entries, compression=zipfile.ZIP_DEFLATED):
    """A zip of (name or ZipInfo, bytes)."""
    target = folder / "scene.zip"
    with zipfile.ZipFile(target, "w", compression) as archive:
        for name, data in entries:
            archive.writestr(name, data)
    return target


def unpacked(folder, archive, limit=1 << 20):
    place = folder / "unpacked"
    place.mkdir()
    unpack(archive, place, limit)
    files = (path for path in place.rglob("*") if path.is_file())
    return {path.relative_to(place).as_posix(): path.read_bytes() for path in files}


def entry(name, mode=0, flags=0):
    info = zipfile.ZipInfo(name)
    info.external_attr = mode << 16
    info.flag_bits = flags
    return info


def test_files_and_folders_are_unpacked(tmp_path):
    archive = archive_of(tmp_path, ("a.obj", b"one"), ("deep/er/b.obj", b"two"), ("empty/", b""))
    assert unpacked(tmp_path, archive) == {"a.obj": b"one", "deep/er/b.obj": b"two"}


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../a.obj", "a/../../b.obj", "..\\a.obj", "C:\\a.obj", "c:a.obj"]
)
def test_names_that_lead_elsewhere_are_refused(tmp_path, name):
    archive = archive_of(tmp_path, ("good.obj", b"one"), (name, b"two"))
    with pytest.raises(UnreadableMeshError, match="lies outside"):
        unpacked(tmp_path, archive)
    assert {path.name for path in tmp_path.rglob("*.obj")} <= {"good.obj"}


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices_are_refused(tmp_path, kind):
    archive = archive_of(tmp_path, (entry("a.obj", kind | 0o777), b"/etc/passwd"))
    with pytest.raises(UnreadableMeshError, match="link or a device"):
        unpacked(tmp_path, archive)


def test_what_comes_out_is_counted_whatever_the_archive_claims(tmp_path):
    archive = archive_of(tmp_path, *((f"{i}.obj", bytes(1000)) for i in range(10)))
    assert len(unpacked(tmp_path, archive, 10_000)) == 10
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(UnreadableMeshError, match="more than may be sent"):
        unpacked(other, archive, 9_999)


def test_a_bomb_is_refused_before_it_fills_the_disk(tmp_path):
    archive = archive_of(tmp_path, ("bomb.obj", bytes(50 << 20)))
    with pytest.raises(UnreadableMeshError, match="more than may be sent"):
        unpacked(tmp_path, archive, 1 << 20)
    assert sum(path.stat().st_size for path in (tmp_path / "unpacked").rglob("*")) < 4 << 20


def test_names_that_clash_are_refused(tmp_path):
    archive = archive_of(tmp_path, ("a", b"file"), ("a/b.obj", b"under it"))
    with pytest.raises(UnreadableMeshError, match="cannot be unpacked"):
        unpacked(tmp_path, archive)


def test_too_many_entries_are_refused(tmp_path):
    names = ((f"{i}", b"") for i in range(20_001))
    archive = archive_of(tmp_path, *names, compression=zipfile.ZIP_STORED)
    with pytest.raises(UnreadableMeshError, match="20,001 entries"):
        unpacked(tmp_path, archive)


def test_what_needs_a_password_is_refused(tmp_path):
    archive = archive_of(tmp_path, ("a.obj", b"one"))
    data = bytearray(archive.read_bytes())
    data[data.index(b"PK\1\2") + 8] |= 1  # the flag, in the directory
    archive.write_bytes(data)
    with pytest.raises(UnreadableMeshError, match="encrypted"):
        unpacked(tmp_path, archive)


def _whole():
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.obj", b"v 0 0 0\n" * 20)
        archive.writestr("b/c.obj", b"v 1 1 1\n")
    return target.getvalue()


WHOLE = _whole()


@given(st.lists(st.tuples(st.integers(0, len(WHOLE) - 1), st.integers(0, 255)), max_size=6),
       st.integers(0, len(WHOLE)))  # fmt: skip
def test_damage_is_refused_or_harmless(tmp_path_factory, changes, length):
    folder = tmp_path_factory.mktemp("damaged")
    data = bytearray(WHOLE)
    for place, value in changes:
        data[place] = value
    archive = folder / "scene.zip"
    archive.write_bytes(data[:length] if length % 2 else data)
    with suppress(UnreadableMeshError):
        unpacked(folder, archive)
    assert {path.name for path in folder.iterdir()} == {"scene.zip", "unpacked"}
