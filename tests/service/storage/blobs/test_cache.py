"""Copies of blobs on the disk: which are kept, and that nobody gets half of one."""

from __future__ import annotations

import os
import threading
import time

import pytest

from service.errors import DiskFullError, SettingsError
from service.storage.blobs.cache import BlobCache
from tests.service.storage.blobs.blob_store_contract import blob_of

CONTENTS = [bytes([letter]) * 100 for letter in b"abcdef"]


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "cache"


class Elsewhere:
    """Where the bytes come from; ``asked`` are those that did."""

    def __init__(self) -> None:
        self.asked: list[bytes] = []

    def __call__(self, data: bytes):
        def blocks():
            self.asked.append(data)
            yield data[:50]
            yield data[50:]

        return blocks


@pytest.fixture
def elsewhere():
    return Elsewhere()


@pytest.fixture
def lay_out(folder, elsewhere, tmp_path):
    """``lay_out(data)`` has the cache make a file, which is returned."""
    cache = BlobCache(folder, 300)
    count = iter(range(100))

    def make(data, cache=cache):
        place = tmp_path / f"place-{next(count)}"
        cache.lay_out(blob_of(data), place, elsewhere(data))
        assert place.read_bytes() == data
        return place

    return make


def copies(folder):
    return {path.read_bytes() for path in folder.iterdir()}


def test_what_was_copied_is_not_copied_again(lay_out, elsewhere, folder):
    first, again = lay_out(CONTENTS[0]), lay_out(CONTENTS[0])
    assert elsewhere.asked == [CONTENTS[0]]
    assert first.stat().st_ino == again.stat().st_ino
    assert first.stat().st_mode & 0o777 == 0o400
    lay_out(CONTENTS[0], BlobCache(folder, 300))  # the next start
    assert elsewhere.asked == [CONTENTS[0]]


def test_those_that_were_wanted_last_are_kept(lay_out, folder):
    places = []
    for number in (0, 1, 2, 0, 3):
        places.append(lay_out(CONTENTS[number]))
        time.sleep(0.01)
    assert copies(folder) == {CONTENTS[0], CONTENTS[2], CONTENTS[3]}
    assert places[1].read_bytes() == CONTENTS[1]  # whoever has it keeps it


def test_one_that_is_larger_than_the_cache_is_not_kept(lay_out, elsewhere, folder):
    large = b"x" * 301
    lay_out(large)
    lay_out(large)
    assert elsewhere.asked == [large, large]
    assert copies(folder) == set()


def test_what_is_dropped_is_copied_anew(lay_out, elsewhere, folder):
    cache = BlobCache(folder, 300)
    lay_out(CONTENTS[0], cache)
    cache.drop(blob_of(CONTENTS[0]))
    lay_out(CONTENTS[0], cache)
    assert elsewhere.asked == [CONTENTS[0]] * 2


def test_a_copy_that_is_cut_off_is_made_anew(lay_out, elsewhere, folder):
    lay_out(CONTENTS[0])
    (copy,) = folder.iterdir()
    copy.chmod(0o600)
    copy.write_bytes(b"half")
    lay_out(CONTENTS[0])
    assert copies(folder) == {CONTENTS[0]}


@pytest.mark.parametrize("limit", [300, 10])
def test_what_cannot_be_had_whole_leaves_nothing(folder, tmp_path, limit):
    def blocks():
        yield b"half"
        raise KeyError("gone")

    with pytest.raises(KeyError, match="gone"):
        BlobCache(folder, limit).lay_out(blob_of(CONTENTS[0]), tmp_path / "place", blocks)
    assert list(folder.iterdir()) == []
    assert not (tmp_path / "place").exists()


def test_room_is_made_and_left_to_others(folder, elsewhere, tmp_path, monkeypatch):
    disk = {"free": 250}
    monkeypatch.setattr("service.storage.blobs.cache.free_bytes", lambda folder: disk["free"])
    monkeypatch.setattr("service.storage.blobs.drafts.free_bytes", lambda folder: disk["free"])
    cache = BlobCache(folder, 10_000, min_free=100)
    cache.lay_out(blob_of(CONTENTS[0]), tmp_path / "a", elsewhere(CONTENTS[0]))
    disk["free"] = 150
    with pytest.raises(DiskFullError):
        cache.lay_out(blob_of(CONTENTS[1]), tmp_path / "b", elsewhere(CONTENTS[1]))
    assert copies(folder) == set()  # the other had to go, in vain
    assert not (tmp_path / "b").exists()


def test_of_those_who_want_the_same_the_first_copies_it(folder, elsewhere, tmp_path):
    cache, go_on = BlobCache(folder, 300), threading.Event()
    blob, data = blob_of(CONTENTS[0]), CONTENTS[0]

    def slowly():
        assert go_on.wait(10)
        yield from elsewhere(data)()

    threads = [
        threading.Thread(target=cache.lay_out, args=(blob, tmp_path / str(number), slowly))
        for number in range(4)
    ]
    for thread in threads:
        thread.start()
    go_on.set()
    for thread in threads:
        thread.join()
    assert elsewhere.asked == [data]
    assert all((tmp_path / str(number)).read_bytes() == data for number in range(4))


def test_what_a_killed_process_was_writing_goes_with_time(folder):
    BlobCache(folder, 300)
    (folder / "old.tmp").write_bytes(b"half")
    (folder / "new.tmp").write_bytes(b"half")
    os.utime(folder / "old.tmp", (0, 0))
    BlobCache(folder, 300)
    assert [path.name for path in folder.iterdir()] == ["new.tmp"]


def test_another_disk_gets_a_copy(folder, elsewhere, tmp_path, monkeypatch):
    def refuse(source, target):
        raise OSError(18, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", refuse)
    place = tmp_path / "place"
    BlobCache(folder, 300).lay_out(blob_of(CONTENTS[0]), place, elsewhere(CONTENTS[0]))
    assert place.read_bytes() == CONTENTS[0]
    assert place.stat().st_mode & 0o777 == 0o400


def test_a_folder_that_cannot_be_made_is_a_matter_of_settings(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingsError, match="copies"):
        BlobCache(tmp_path / "file" / "cache", 300)
