"""``docs/operations.md``: its alerts read what is told, and its back-up brings everything back."""

from __future__ import annotations

import re
import stat
import subprocess

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from tests.acceptance.command import ROOT
from tests.faults.serving import LIGHT_WORK, Server, path_of_processes
from tests.waiting import until

PAGE = (ROOT / "docs/operations.md").read_text()
_SUFFIXES = ("_total", "_bucket", "_count", "_sum")


def block(heading, language):
    """The first block of a language under a heading."""
    section = PAGE.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    return re.search(rf"```{language}\n(.*?)```", section, re.DOTALL)[1]


def rules():
    blocks = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    (group,) = next(one for one in map(yaml.safe_load, blocks) if "groups" in one)["groups"]
    return group["rules"]


@pytest.fixture(scope="module")
def serving(tmp_path_factory):
    """A server whose jobs are light, on the folder that the page has; it serves after each test."""
    folder = tmp_path_factory.mktemp("serving")
    server = Server(
        path_of_processes(folder / "declared"), folder / "occluder_data",
        FAULTS_WORK=str(LIGHT_WORK), OCCLUDER_DASHBOARD="false",
    ).start()  # fmt: skip
    yield server
    server.kill()


def test_there_are_five_alerts_each_with_what_to_do():
    assert len(rules()) == 5
    for rule in rules():
        assert set(rule["annotations"]) == {"summary", "action"}, rule["alert"]
        for opening, closing in ("()", "[]", "{}"):
            assert rule["expr"].count(opening) == rule["expr"].count(closing), rule["alert"]


def test_alerts_read_what_the_service_tells(serving):
    until(lambda: "responses_total" in serving.get("/metrics").text)
    families = {
        one.name: one for one in text_string_to_metric_families(serving.get("/metrics").text)
    }
    labels = {
        name: {label for sample in family.samples for label in sample.labels}
        for name, family in families.items()
    }
    read = re.findall(r"\b(occluder_\w+)(?:\{([^}]*)\})?", " ".join(one["expr"] for one in rules()))
    read += re.findall(r"\b(occluder_http_request_seconds_bucket)\{([^}]*)\}", PAGE)
    assert len(read) >= 9
    for name, matchers in read:
        family = next((name.removesuffix(end) for end in _SUFFIXES if name.endswith(end)), name)
        assert family in families, name
        assert {one.split("=")[0].strip(" !") for one in filter(None, matchers.split(","))} <= (
            labels[family]
        ), name


def test_a_copy_made_while_it_runs_brings_every_job_back(serving, tmp_path, monkeypatch):
    folder = serving.data.parent
    monkeypatch.chdir(folder)
    gate = tmp_path / "gate"
    done = [serving.submit(f"# {number}") for number in range(3)]
    for job_id in done:
        serving.end_of(job_id)
    running, waiting = serving.submit(f"# wait {gate}"), serving.submit("# later")
    until(lambda: serving.job(running)["state"] == "running")
    run(block("Back-up", "sh"))
    late = serving.submit("# too late")
    serving.kill()

    gate.touch()
    restore, _, serve = block("Restore", "sh").strip().rpartition("\n")
    assert serve == "occluder serve"
    run(restore)
    assert (folder / "occluder_data.old").is_dir()
    serving.start()
    assert {job["id"] for job in serving.jobs()} == {*done, running, waiting}
    for job_id in (*done, running, waiting):
        assert serving.end_of(job_id)["state"] == "succeeded"
        serving.assert_served_whole(job_id)
    assert serving.get(f"/v1/jobs/{late}").status_code == 404
    assert secret_of(folder / "backup") == secret_of(folder / "occluder_data.old")
    for name in ("occluder.db", "webhook_secret"):
        assert not stat.S_IMODE((folder / "backup" / name).stat().st_mode) & 0o077


def test_a_slip_in_the_folders_name_is_no_empty_copy(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(subprocess.CalledProcessError):
        run(block("Back-up", "sh"))
    assert not (tmp_path / "occluder_data").exists()
    copy = tmp_path / "backup" / "occluder.db"
    assert not copy.exists() or not copy.stat().st_size


def run(words):
    subprocess.run(["bash", "-euc", words], check=True, capture_output=True)


def secret_of(folder):
    return (folder / "webhook_secret").read_bytes()
