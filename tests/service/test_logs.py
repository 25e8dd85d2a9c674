"""A request's id is in every line of what is done for it, in a form that programs read."""

from __future__ import annotations

import json
import logging
import os
import threading
from contextlib import contextmanager

import httpx
import pytest

from service.errors import SettingsError
from service.jobs.job import JobState
from service.logs import JsonLines, LogForm, TextLines, log_as, request_id, serving_request
from service.settings import read_settings
from tests.acceptance.command import ROOT
from tests.faults.serving import LIGHT_WORK, SURROUNDINGS
from tests.service.declared import declare
from tests.service.engines.workplace import Workplace
from tests.service.real import BOX, running
from tests.service.webhooks.receivers import receiving
from tests.waiting import until


@contextmanager
def logging_as(form, **more):
    """In place of what pytest does with the log."""
    logger = logging.getLogger()
    handlers, logger.handlers = logger.handlers, []
    log_as(form, **more)
    try:
        yield logging.getLogger("service.requests")
    finally:
        logger.handlers = handlers


def test_json_is_an_object_a_line(capsys):
    fields = {"status": 500, "path": "/\n"}
    with logging_as(LogForm.JSON) as log:
        with serving_request("build-7"):
            try:
                raise ValueError("line\nbreak")
            except ValueError:
                log.exception("it %s", "failed", extra={"fields": fields})
        log.error("later")
    first, second = map(json.loads, capsys.readouterr().err.splitlines())
    assert first.pop("time").endswith("+00:00")
    assert first.pop("exception").endswith("ValueError: line\nbreak")
    assert first == {
        "level": "error", "logger": "service.requests", "message": "it failed",
        "request_id": "build-7", "status": 500, "path": "/\n",
    }  # fmt: skip
    assert "request_id" not in second


def test_a_line_for_people_ends_with_the_id_once(capsys):
    with logging_as(LogForm.TEXT, text="%(message)s") as log:
        with serving_request("build-7"):
            log.error("it failed")
            log.error("GET / id=build-7")
        log.error("later")
    assert capsys.readouterr().err.splitlines() == [
        "it failed id=build-7", "GET / id=build-7", "later",
    ]  # fmt: skip


def test_an_id_is_of_its_thread_and_ends_with_its_block():
    seen = []
    with serving_request("outer"):
        with serving_request(None):
            seen.append(request_id())
        thread = threading.Thread(target=lambda: seen.append(request_id()))
        thread.start()
        thread.join()
        seen.append(request_id())
    assert [*seen, request_id()] == [None, None, "outer", None]


@pytest.mark.parametrize("form", [JsonLines(), TextLines("%(message)s")])
def test_a_record_of_a_foreign_handler_is_written_too(form):
    record = logging.LogRecord("x", logging.INFO, __file__, 1, "hello", (), None)
    assert "hello" in form.format(record)


def test_the_setting_is_one_of_two_words(monkeypatch):
    monkeypatch.setenv("OCCLUDER_LOG", "json")
    assert read_settings({}).log is LogForm.JSON
    monkeypatch.setenv("OCCLUDER_LOG", "xml")
    with pytest.raises(SettingsError, match="OCCLUDER_LOG cannot be 'xml'"):
        read_settings({})


def test_the_id_goes_from_the_request_by_the_job_to_its_webhook(tmp_path):
    path = os.pathsep.join([str(SURROUNDINGS), str(declare(tmp_path / "declared")), str(ROOT)])
    variables = {
        "FAULTS_WORK": str(LIGHT_WORK), "OCCLUDER_DASHBOARD": "false", "OCCLUDER_LOG": "json",
        "OCCLUDER_WEBHOOK_PRIVATE": "true",
    }  # fmt: skip
    with receiving() as receiver, running(path, tmp_path / "data", **variables) as server:
        answer = httpx.post(
            f"{server.address}/v1/occluders?filename=a.obj&webhook={receiver.url}",
            content=BOX, headers={"X-Request-Id": "build-7"},
        )  # fmt: skip
        job = answer.json()
        assert answer.headers["x-request-id"] == job["request_id"] == "build-7"
        until(lambda: receiver.heard)
        until(lambda: "was heard" in server.log.read_text())
        ended = httpx.get(f"{server.address}/v1/jobs/{job['id']}").json()
        assert (ended["state"], ended["request_id"]) == (JobState.SUCCEEDED, "build-7")
        (heard,) = receiver.heard
        assert heard.headers["x-request-id"] == "build-7"
        assert json.loads(heard.body)["job"]["request_id"] == "build-7"
        assert server.end() == 0
    lines = [json.loads(line) for line in server.log.read_text().splitlines()]
    ours = [one for one in lines if one.get("request_id") == "build-7"]
    assert [one["logger"].rpartition(".")[2] for one in ours if "job" not in one] == ["requests"]
    (request,) = [one for one in ours if "path" in one]
    assert (request["method"], request["path"], request["status"]) == (
        "POST", "/v1/occluders", 202,
    )  # fmt: skip
    of_job = [one for one in ours if one.get("job") == job["id"]]
    assert [one.get("state") for one in of_job] == ["running", "succeeded", None]
    assert of_job[-1]["status"] == 204
    made = [one["request_id"] for one in lines if one.get("path") == f"/v1/jobs/{job['id']}"]
    assert made
    assert "build-7" not in made


def test_a_worker_logs_as_the_server_does(tmp_path, monkeypatch, capfd):
    """In a process of its own, which is told by the environment alone."""
    monkeypatch.setenv("OCCLUDER_LOG", "json")
    place = Workplace(tmp_path / "place", workers=1)
    with place.open():
        assert place.end_of(place.submit("fault", request_id="build-7")).state is JobState.FAILED
    told = [json.loads(line) for line in capfd.readouterr().err.splitlines() if line[:1] == "{"]
    (fault,) = [one for one in told if one["logger"] == "service.engines.worker"]
    assert fault["request_id"] == "build-7"
    assert "ZeroDivisionError" in fault["exception"]
