"""Machine code is found only where it belongs to the sources and to what it runs in."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from simplifier.kernels.compiled import code_files
from simplifier.kernels.compiled.code_files import code_name, find_code, write_code


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Three kernel files, of which ``far`` is called by ``near``, and that by ``one``."""
    kernels = tmp_path / "kernels"
    kernels.mkdir()
    for name, calls in (("one", "near"), ("near", "far"), ("far", ""), ("other", "")):
        line = f"from simplifier.kernels.{calls} import x\n" if calls else ""
        (kernels / f"{name}.py").write_text(f"{line}# {name}\n")
    monkeypatch.setattr(code_files, "KERNELS", kernels)
    monkeypatch.setattr(code_files, "SHIPPED", kernels / "machine_code")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    forget()
    yield tmp_path / "cache"
    monkeypatch.undo()
    forget()


def forget():
    for cached in ("_source", "_sources", "_makers", "_environment", "writable_folder"):
        getattr(code_files, cached).cache_clear()


def change(name):
    path = code_files.KERNELS / f"{name}.py"
    path.write_text(path.read_text() + "# changed\n")
    forget()


def test_code_is_found_until_a_source_changes_that_it_was_made_of(folder):
    write_code(folder, "one", b"code")
    assert find_code("one").read_bytes() == b"code"
    assert find_code("other") is None
    change("other")
    assert find_code("one") is not None
    change("far")  # which is called by what it calls
    assert find_code("one") is None


def test_new_code_takes_the_place_of_old_and_of_what_numba_keeps(folder):
    write_code(folder, "one", b"old")
    write_code(folder, "other", b"other")
    for name in ("one.f-3.py311.nbi", "other.f-3.py311.nbi"):
        (folder / name).touch()
    change("near")
    write_code(folder, "one", b"new")
    assert {path.name for path in folder.iterdir()} == {
        code_name("one"), code_name("other"), "other.f-3.py311.nbi",
    }  # fmt: skip
    assert find_code("one").read_bytes() == b"new"


def test_code_that_was_brought_along_is_found_until_its_source_changes(folder):
    write_code(code_files.SHIPPED, "one", b"brought")
    assert find_code("one").read_bytes() == b"brought"
    write_code(folder, "other", b"made here")
    assert find_code("other").read_bytes() == b"made here"
    change("near")
    assert find_code("one") is None
    write_code(folder, "one", b"made here")
    assert find_code("one").read_bytes() == b"made here"


def test_code_for_a_processor_that_is_named_is_found_where_that_is_named(folder, monkeypatch):
    monkeypatch.setenv("NUMBA_CPU_NAME", "")
    forget()
    write_code(folder, "one", b"for this one")
    monkeypatch.setenv("NUMBA_CPU_NAME", "x86-64-v3")
    forget()
    assert find_code("one") is None
    write_code(folder, "one", b"for any of a kind")
    assert ".x86-64-v3-" in code_name("one")
    assert find_code("one").read_bytes() == b"for any of a kind"
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+avx512f")
    forget()
    assert find_code("one") is None
    monkeypatch.setenv("NUMBA_CPU_NAME", "")
    forget()
    assert find_code("one").read_bytes() == b"for this one"


def test_another_version_of_numba_or_python_is_another_environment(folder, monkeypatch):
    monkeypatch.setenv("NUMBA_CPU_NAME", "")  # this very processor
    forget()
    names = {code_name("one")}
    for place, what in (
        (code_files, "_numba_version"),
        (code_files.llvm, "get_host_cpu_name"),
        (code_files.llvm, "get_process_triple"),
    ):
        with monkeypatch.context() as patched:
            patched.setattr(place, what, lambda: "another")
            forget()
            names.add(code_name("one"))
    assert len(names) == 4


def test_a_write_that_fails_leaves_nothing(folder, monkeypatch):
    write_code(folder, "other", b"other")
    with pytest.raises(TypeError):
        write_code(folder, "one", None)
    assert [path.name for path in folder.iterdir()] == [code_name("other")]


@pytest.mark.parametrize(
    ("platform", "variable"), [("linux", "XDG_CACHE_HOME"), ("win32", "LOCALAPPDATA")]
)
@pytest.mark.usefixtures("folder")
def test_where_the_package_cannot_be_written_the_users_cache_is(
    tmp_path, monkeypatch, platform, variable
):
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    forget()
    read_only(monkeypatch, code_files.KERNELS)
    monkeypatch.setattr(code_files.sys, "platform", platform)
    monkeypatch.setenv(variable, str(tmp_path / "home"))
    assert code_files.writable_folder() == tmp_path / "home" / "planar-occluder" / "kernels"


def read_only(monkeypatch, *folders):
    """As for one who may not write there: whoever runs the tests may write everywhere."""

    def access(path, mode):
        return not any(Path(path).is_relative_to(folder) for folder in folders)

    monkeypatch.setattr(code_files.os, "access", access)


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.usefixtures("folder")
def test_where_nothing_can_be_written_code_lasts_as_long_as_the_process(
    tmp_path, monkeypatch, caplog, named
):
    """Every command once ended with numba's "no locator available"."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    if named:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(home / "named"))
    else:
        monkeypatch.delenv("NUMBA_CACHE_DIR")
        monkeypatch.setattr(code_files.sys, "platform", "linux")
    forget()
    read_only(monkeypatch, code_files.KERNELS, home)
    folder = code_files.writable_folder()
    assert folder.is_dir()
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
    assert list(home.iterdir()) == []
    (record,) = caplog.records
    assert str(home / ("named" if named else "planar-occluder")) in record.message
    assert "set NUMBA_CACHE_DIR" in record.message
    write_code(folder, "one", b"code")
    assert find_code("one") == folder / code_name("one")


@pytest.mark.usefixtures("folder")
def test_code_that_another_user_has_kept_is_found(tmp_path, monkeypatch):
    kept = tmp_path / "kept"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(kept))
    forget()
    write_code(kept, "one", b"code")
    read_only(monkeypatch, kept)
    forget()
    assert find_code("one") == kept / code_name("one")


def test_a_folder_below_a_file_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    assert not code_files._can_be_written(tmp_path / "file" / "cache")
    assert code_files._can_be_written(tmp_path / "one" / "cache")


@pytest.mark.usefixtures("folder")
def test_code_lies_beside_the_kernels_where_that_can_be_written(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    forget()
    assert code_files.writable_folder() == code_files.KERNELS / "__pycache__"
