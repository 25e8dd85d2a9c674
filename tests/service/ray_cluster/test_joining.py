"""What is refused before Ray is asked; what Ray itself refuses is tried in ``tests/cluster``."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from service.errors import SettingsError
from service.ray_cluster.joining import check_address, has_token, load_ray

TOKEN = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": "0" * 48}


@pytest.fixture(autouse=True)
def no_token_at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("address", ["127.0.0.1:6379", "localhost:6379", "[::1]:6379", "auto"])
def test_on_this_machine_no_token_is_needed(address: str) -> None:
    check_address(address, {})


@pytest.mark.parametrize("address", ["10.0.0.7:6379", "head.example.org:6379", "[2001:db8::1]:1"])
def test_beyond_it_one_is(address: str) -> None:
    check_address(address, TOKEN)
    for without in ({}, {"RAY_AUTH_MODE": "disabled", "RAY_AUTH_TOKEN": "0" * 48}):
        with pytest.raises(SettingsError, match="without a token"):
            check_address(address, without)


@pytest.mark.parametrize("address", ["ray://head:10001", "head", "head:", ":6379", "head:port"])
def test_what_is_no_address_of_a_head_is_refused(address: str) -> None:
    with pytest.raises(SettingsError, match="HOST:PORT"):
        check_address(address, TOKEN)


def test_a_token_that_lies_where_ray_looks_for_it_counts(no_token_at_home: Path) -> None:
    assert not has_token({})
    (no_token_at_home / ".ray").mkdir()
    (no_token_at_home / ".ray" / "auth_token").write_text("0" * 48)
    assert has_token({})
    assert not has_token({"RAY_AUTH_MODE": "disabled"})


def test_where_ray_is_not_installed_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(SettingsError, match=r"pip install 'planar-occluder\[ray\]'"):
        load_ray()
