"""The data folder: private, of one server, and telling what is wrong with it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from service.errors import DatabaseDamagedError, SettingsError
from service.storage.data_folder import DataFolder

OWN = """
import sys
from pathlib import Path
from service.storage.data_folder import DataFolder
with DataFolder(Path(sys.argv[1])).own():
    print("owned", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def folder(tmp_path):
    return DataFolder(tmp_path / "of" / "ours")


@pytest.fixture
def server(folder):
    """Another process that owns the folder."""
    command = [sys.executable, "-c", OWN, str(folder.path)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout.readline() == "owned\n"
        yield process
        process.kill()


def test_it_is_made_for_nobody_else_to_look_into(folder):
    with folder.own():
        for made in (folder.path, folder.blobs, folder.scratch):
            assert made.stat().st_mode & 0o777 == 0o700
        assert folder.lock.read_text() == f"{os.getpid()}\n"


def test_a_second_server_is_told_which_is_the_first(folder, server):
    with pytest.raises(SettingsError, match=rf"process {server.pid}\).*OCCLUDER_DATA"):
        folder.own().__enter__()
    assert folder.lock.read_text() == f"{server.pid}\n"


@pytest.mark.parametrize("emptied", [True, False])
def test_no_database_is_made_where_blobs_tell_of_another(folder, emptied):
    folder.make()
    folder.open_database().close()
    (folder.blobs / "ab").mkdir()
    folder.open_database().close()  # a first start that was broken off
    (folder.blobs / "ab" / ("c" * 62)).touch()
    folder.open_database().close()
    folder.database.unlink()
    if emptied:
        folder.database.touch()
    for _ in range(2):  # and the next start finds none of what this one has begun
        with pytest.raises(DatabaseDamagedError, match=r"is gone.*backup"):
            folder.open_database()


def test_a_killed_server_keeps_nobody_out(folder, server):
    server.kill()
    server.wait()
    with folder.own():
        assert folder.lock.read_text() == f"{os.getpid()}\n"
    with folder.own():
        pass


def test_the_folder_is_free_again_after_an_error(folder):
    for _ in range(2):
        with pytest.raises(ZeroDivisionError), folder.own():
            raise ZeroDivisionError


def test_commands_use_the_folder_beside_the_server(folder, server):
    folder.make()
    assert folder.database.parent == folder.path


def test_scratch_is_empty_at_the_start_and_links_are_not_followed(folder, tmp_path):
    folder.make()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "file").write_text("stays")
    (folder.scratch / "job" / "deep").mkdir(parents=True)
    (folder.scratch / "job" / "deep" / "half.glb").write_text("half")
    (folder.scratch / "stray").write_text("")
    (folder.scratch / "link").symlink_to(tmp_path / "elsewhere")
    (folder.blobs / "kept").write_text("kept")
    with folder.own():
        assert list(folder.scratch.iterdir()) == []
    assert (tmp_path / "elsewhere" / "file").exists()
    assert (folder.blobs / "kept").exists()


def test_a_second_server_does_not_empty_the_scratch_of_the_first(folder, server):
    (folder.scratch / "work").write_text("under way")
    with pytest.raises(SettingsError):
        folder.own().__enter__()
    assert (folder.scratch / "work").exists()


def test_a_file_in_its_place_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(SettingsError, match=r"file.*cannot be used.*OCCLUDER_DATA"):
            DataFolder(path).make()


def test_a_folder_without_the_right_to_write_is_told(folder, monkeypatch):
    """Whoever runs as root may write everywhere, so the system's answer is made up."""
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(SettingsError, match="no right to write"):
        folder.make()
