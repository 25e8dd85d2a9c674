"""What the service is told, and how it says what is wrong with that."""

from __future__ import annotations

import re

import pytest

from service.errors import SettingsError
from service.settings import Settings, read_settings, settings_table, unknown_settings
from tests.acceptance.command import ROOT


@pytest.fixture(autouse=True)
def nothing_set(monkeypatch):
    for name in Settings.model_fields:
        monkeypatch.delenv(f"OCCLUDER_{name.upper()}", raising=False)


def test_the_table_in_the_docs_is_current():
    assert settings_table() in (ROOT / "docs" / "service.md").read_text(), (
        "write what `python -m service.settings` prints to the end of docs/service.md"
    )


def test_the_command_line_goes_before_the_environment(monkeypatch):
    monkeypatch.setenv("OCCLUDER_PORT", "7000")
    monkeypatch.setenv("OCCLUDER_WORKERS", "3")
    settings = read_settings({"port": 9000, "host": None})
    assert (settings.port, settings.workers, settings.host) == (9000, 3, "127.0.0.1")


def test_every_wrong_setting_has_its_line(monkeypatch):
    monkeypatch.setenv("OCCLUDER_WORKERS", "many")
    monkeypatch.setenv("OCCLUDER_PUBLIC_URL", "ftp://example.org")
    with pytest.raises(SettingsError) as refused:
        read_settings({"port": 70_000})
    lines = str(refused.value).splitlines()
    assert len(lines) == 3
    for name, words in (
        ("OCCLUDER_WORKERS cannot be 'many'", "Jobs done at the same time"),
        ("OCCLUDER_PUBLIC_URL cannot be 'ftp://example.org'", "must begin with http"),
        ("OCCLUDER_PORT cannot be 70000", "less than or equal to 65535"),
    ):
        assert any(line.startswith(name) and words in line for line in lines), lines


def test_a_slip_of_the_keyboard_is_noticed(monkeypatch):
    monkeypatch.setenv("OCCLUDER_MAX_UPLAOD", "1")
    monkeypatch.setenv("OCCLUDER_KEY", "occ_x")  # is not the server's
    assert list(unknown_settings()) == [
        "OCCLUDER_MAX_UPLAOD is no setting and does nothing; did you mean OCCLUDER_MAX_UPLOAD?"
    ]


@pytest.mark.parametrize(
    "file",
    [
        "docs/service.md",
        "docker/Dockerfile",
        "docker/compose.yaml",
        "docker/compose.cluster.yaml",
        "docker/check.sh",
        "docs/scale.md",
        "docs/bucket.md",
    ],
)
def test_every_variable_that_is_written_about_is_there(file):
    known = {f"OCCLUDER_{name.upper()}" for name in Settings.model_fields}
    known |= {"OCCLUDER_KEY", "OCCLUDER_SERVER"}  # of 'occluder submit'
    named = set(re.findall(r"\bOCCLUDER_[A-Z_]+", (ROOT / file).read_text()))
    assert named - known == set()
