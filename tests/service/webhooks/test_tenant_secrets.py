"""The secrets of tenants, and the file that they come from."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from service.errors import SettingsError
from service.webhooks.tenant_secrets import TenantSecrets


def test_a_secret_stays_the_same_from_start_to_start(tmp_path: Path) -> None:
    first = TenantSecrets.open(tmp_path).of("studio")
    assert TenantSecrets.open(tmp_path).of("studio") == first
    assert first.startswith("whsec_")
    assert len(first) >= 40


def test_tenants_and_folders_have_their_own(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    secrets = TenantSecrets.open(tmp_path)
    others = TenantSecrets.open(tmp_path / "other")
    assert len({secrets.of("a"), secrets.of("b"), others.of("a"), others.of("b")}) == 4


def test_only_the_owner_may_read_it(tmp_path: Path) -> None:
    TenantSecrets.open(tmp_path)
    (file,) = tmp_path.iterdir()
    assert file.stat().st_mode & 0o777 == 0o600


def test_processes_that_start_at_once_agree(tmp_path: Path) -> None:
    with ThreadPoolExecutor(16) as pool:
        found = list(pool.map(lambda _: TenantSecrets.open(tmp_path).of("a"), range(64)))
    assert len(set(found)) == 1
    assert len(list(tmp_path.iterdir())) == 1


def test_a_secret_that_others_may_read_is_refused(tmp_path: Path) -> None:
    TenantSecrets.open(tmp_path)
    (tmp_path / "webhook_secret").chmod(0o644)
    with pytest.raises(SettingsError, match="chmod 600"):
        TenantSecrets.open(tmp_path)


@pytest.mark.parametrize("damage", [b"", b"short", b"x" * 33])
def test_a_damaged_secret_is_not_replaced_in_silence(tmp_path: Path, damage: bytes) -> None:
    TenantSecrets.open(tmp_path)
    (tmp_path / "webhook_secret").write_bytes(damage)
    with pytest.raises(SettingsError, match="damaged"):
        TenantSecrets.open(tmp_path)
    assert (tmp_path / "webhook_secret").read_bytes() == damage


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=f"{tmp_path}{os.sep}none"):
        TenantSecrets.open(tmp_path / "none")
