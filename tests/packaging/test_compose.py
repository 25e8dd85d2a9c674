"""The files for docker compose, as far as that is seen without an engine."""

from __future__ import annotations

import re

import pytest
import yaml

from service.settings import read_settings, unknown_settings
from service.storage.opening import check_for_worker, check_together
from tests.acceptance.command import ROOT

CLUSTER = ROOT / "docker" / "compose.cluster.yaml"
ASKED_FOR = {"POSTGRES_PASSWORD": "secret", "S3_SECRET_KEY": "secret"}


def services(file):
    """By name, with what a person has to set in place."""

    def value(match):
        return ASKED_FOR[match[1]]

    text = re.sub(r"\$\{(\w+)(?::\?[^}]*)?\}", value, file.read_text())
    return yaml.safe_load(text)["services"]


def ours(file):
    found = services(file)
    return {name: one for name, one in found.items() if one.get("image") == "planar-occluder"}


@pytest.mark.parametrize("name", ours(CLUSTER))
def test_each_part_of_a_cluster_is_set_up_as_it_has_to_be(monkeypatch, name):
    service = ours(CLUSTER)[name]
    for variable, value in service["environment"].items():
        monkeypatch.setenv(variable, value)
    settings = read_settings({})
    assert not list(unknown_settings())
    assert settings.database_url
    assert settings.blobs
    match service.get("command", ["serve"]):
        case ["serve"]:
            check_together(settings)
        case ["work"]:
            check_for_worker(settings)
            room = settings.workers * settings.job_memory
            assert room < gibibytes(service["mem_limit"]) * 2**30
        case [command]:
            assert command == "migrate"


def test_it_has_two_servers_and_workers_beside_them():
    commands = [one.get("command", ["serve"])[0] for one in ours(CLUSTER).values()]
    assert sorted(commands) == ["migrate", "serve", "serve", "work", "work"]


def gibibytes(text):
    return int(re.fullmatch(r"(\d+)g", text)[1])
