"""The receiver against the real service: from a mesh to a file of the pipeline."""

from __future__ import annotations

import http.client
import json
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

import simplifier
from examples.webhook_receiver import __main__ as program
from examples.webhook_receiver.ledger import Ledger
from examples.webhook_receiver.server import LARGEST, make_server
from examples.webhook_receiver.writing import Writer
from service.app import create_app
from service.client import Client
from service.settings import Settings
from service.webhooks.rotation import CurrentSecrets
from service.webhooks.sender import WebhookSender
from service.webhooks.signing import sign
from service.webhooks.tenant_secrets import TenantSecrets
from tests.acceptance.command import ROOT, environment
from tests.git import git
from tests.service.real import BOX, QUICK
from tests.service.routes.serving import listening
from tests.service.webhooks.receivers import Ages, Deliveries
from tests.waiting import until

COMMIT = ROOT / "examples" / "webhook_receiver" / "commit.sh"


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """A service that runs, a client of it, and what its webhooks are signed with."""
    settings = Settings(
        data=tmp_path_factory.mktemp("service") / "data", workers=1, min_free=0,
        webhook_private=True,
    )  # fmt: skip
    with listening(create_app(settings)) as address, Client(address) as client:
        secrets = TenantSecrets.open(settings.data)
        yield SimpleNamespace(
            address=address,
            client=client,
            settings=settings,
            secrets=CurrentSecrets(secrets, Ages()),
            secret=secrets.of("local"),
        )


@pytest.fixture(scope="module")
def job(service):
    """One that has succeeded, as webhooks tell it."""
    return done(service, "props/box")


def done(service, asset, **options):
    ended = service.client.wait(
        service.client.submit(BOX, name="box.obj", options={**QUICK, **options}, asset=asset).id
    )
    assert ended.summary is not None
    return {
        "id": ended.id, "kind": "occluder", "state": "succeeded", "name": ended.name,
        "asset": {"id": ended.asset_id, "name": ended.asset}, "created": ended.created,
    }  # fmt: skip


@contextmanager
def receiving(service, folder, then=(), port=0):
    """A receiver that writes to ``folder/assets``; its port."""
    (folder / "assets").mkdir(exist_ok=True)
    writer = Writer(service.client, folder / "assets", Ledger(folder / "heard.db"), then)
    with make_server("127.0.0.1", port, service.secret, writer.write) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


def tell(port, secret, job, delivery="d1", *, at=None, **headers):
    """Send a word as the service does; the status of the answer."""
    body = json.dumps({"event": "job.ended", "id": delivery, "created": "", "job": job}).encode()
    stamp = int(time.time() if at is None else at)
    signed = {
        "Occluder-Timestamp": str(stamp),
        "Occluder-Signature": sign(secret, stamp, body),
        "Occluder-Delivery": delivery,
    }
    return post(port, body, {**signed, **headers})


def post(port, body, headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    try:
        connection.request("POST", "/", body, headers)
        return connection.getresponse().status
    finally:
        connection.close()


def files(folder):
    return sorted(path.name for path in (folder / "assets").rglob("*") if path.is_file())


def test_a_job_of_the_service_leaves_its_occluder_in_the_folder(service, tmp_path):
    with receiving(service, tmp_path) as port:
        hook = f"http://127.0.0.1:{port}/hook"
        service.client.submit(
            BOX, name="box.obj", options={**QUICK, "seed": 1}, asset="props/crate", webhook=hook
        )
        target = tmp_path / "assets" / "props" / "crate_occluder.glb"
        until(target.exists, 60.0)
    assert 0 < len(simplifier.load(target).faces) <= 64


def test_a_word_with_the_right_signature_is_written(service, job, tmp_path):
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, job) == 204
    assert files(tmp_path) == ["box_occluder.glb"]


@pytest.mark.parametrize("wrong", ["secret", "old", "early", "unsigned", "body"])
def test_a_word_that_is_not_signed_and_fresh_is_refused(service, job, tmp_path, wrong):
    with receiving(service, tmp_path) as port:
        if wrong == "secret":
            status = tell(port, "whsec_guessed", job)
        elif wrong in ("old", "early"):
            status = tell(port, service.secret, job, at=time.time() + (-400, 400)[wrong == "early"])
        elif wrong == "unsigned":
            status = post(port, b"{}", {})
        else:
            stamp = str(int(time.time()))
            signature = sign(service.secret, int(stamp), b"{}")
            headers = {"Occluder-Timestamp": stamp, "Occluder-Signature": signature}
            status = post(port, b'{"id": 1}', headers)
    assert status == 401
    assert files(tmp_path) == []


def test_a_word_that_comes_again_does_nothing_also_after_a_new_start(service, job, tmp_path):
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, job) == 204
    (target,) = (tmp_path / "assets").rglob("*.glb")
    target.write_bytes(b"touched by an artist")
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, job) == 204
        # The header of the id is not signed: another one there is no other word.
        assert tell(port, service.secret, job, **{"Occluder-Delivery": "d2"}) == 204
    assert target.read_bytes() == b"touched by an artist"


def test_an_older_job_does_not_replace_what_a_newer_one_made(service, job, tmp_path):
    newer = done(service, "props/box", budget=6)
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, newer, "d2") == 204
        assert tell(port, service.secret, job, "d1") == 204
    assert len(simplifier.load(tmp_path / "assets/props/box_occluder.glb").faces) <= 6


def test_a_job_that_failed_writes_nothing(service, job, tmp_path):
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, {**job, "state": "failed"}) == 204
    assert files(tmp_path) == []


@pytest.mark.parametrize("name", ["../escape", "/etc/escape", "a//b", r"..\escape", "link/escape"])
def test_a_name_that_leads_out_of_the_folder_is_refused(service, job, tmp_path, name):
    (tmp_path / "assets").mkdir()
    (tmp_path / "outside").mkdir()
    (tmp_path / "assets" / "link").symlink_to(tmp_path / "outside")
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, {**job, "asset": {"id": "a", "name": name}}) == 204
    assert list(tmp_path.rglob("*.glb")) == []


@pytest.mark.parametrize(
    ("length", "status"),
    [(None, 411), ("-1", 411), ("many", 411), (str(LARGEST + 1), 413), ("9" * 5000, 413)],
)
def test_a_word_of_no_or_too_great_length_is_refused_unread(service, tmp_path, length, status):
    with receiving(service, tmp_path) as port:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.putrequest("POST", "/")
        if length is not None:
            connection.putheader("Content-Length", length)
        connection.endheaders()
        assert connection.getresponse().status == status
        connection.close()


def test_what_cannot_be_written_is_asked_for_again(service, job, tmp_path):
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "props").write_text("a file where a folder should be")
    with receiving(service, tmp_path) as port:
        assert tell(port, service.secret, job) == 503
        (tmp_path / "assets" / "props").unlink()
        assert tell(port, service.secret, job) == 204
    assert files(tmp_path) == ["box_occluder.glb"]


def test_the_command_that_follows_commits_once_and_its_failure_is_tried_again(
    service, job, tmp_path
):
    assets = tmp_path / "assets"
    assets.mkdir()
    with receiving(service, tmp_path, [str(COMMIT)]) as port:
        assert tell(port, service.secret, job) == 503  # this is no repository
        git(assets, "init", "-q")
        git(assets, "config", "user.name", "t")
        git(assets, "config", "user.email", "t@example.org")
        assert tell(port, service.secret, job) == 204
        assert tell(port, service.secret, job, "d2") == 204  # the same bytes: nothing to commit
    assert git(assets, "log", "--format=%s") == "occluder: box_occluder.glb\n"
    assert git(assets, "status", "--porcelain") == ""


def test_a_receiver_that_is_down_at_first_is_told_later(service, job, tmp_path):
    with receiving(service, tmp_path) as port:
        pass  # a port that was free a moment ago
    deliveries = Deliveries()
    deliveries.add(f"http://127.0.0.1:{port}/", tenant="local", job=job["id"])
    sender = WebhookSender(
        deliveries, lambda delivery: {**job, "ended": ""}, service.secrets, service.settings
    )
    sender.start()
    try:
        until(lambda: deliveries.of("postponed"))
        with receiving(service, tmp_path, port=port):
            deliveries.now += 3600.0
            sender.wake()
            until(lambda: deliveries.of("delivered"))
    finally:
        sender.stop()
    assert files(tmp_path) == ["box_occluder.glb"]


def test_the_program_receives_until_it_is_interrupted(service, job, tmp_path):
    (tmp_path / "assets").mkdir()
    command = [
        sys.executable, "-m", "examples.webhook_receiver", "--server", service.address,
        "--folder", "assets", "--port", "0", "--then", "cp -t .",
    ]  # fmt: skip
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, text=True,
        env=environment(OCCLUDER_WEBHOOK_SECRET=service.secret, OCCLUDER_KEY=None),
    ) as process:  # fmt: skip
        try:
            port = int(process.stdout.readline().rpartition(":")[2])
            assert tell(port, "whsec_guessed", job) == 401
            assert tell(port, service.secret, job) == 204
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 0
        finally:
            process.kill()
    assert files(tmp_path) == ["box_occluder.glb"] * 2  # as it was written, and by the command


def test_the_program_says_what_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OCCLUDER_WEBHOOK_SECRET", raising=False)
    monkeypatch.delattr(program, "make_server")  # or one that lacks nothing would run for ever
    arguments = ["webhook_receiver", "--server", "http://127.0.0.1:1", "--folder"]
    for folder, secret, said in [
        (str(tmp_path), None, "set OCCLUDER_WEBHOOK_SECRET"),
        ("nowhere", "s", "there is no folder 'nowhere'"),
    ]:
        if secret is not None:
            monkeypatch.setenv("OCCLUDER_WEBHOOK_SECRET", secret)
        monkeypatch.setattr(sys, "argv", [*arguments, folder])
        with pytest.raises(SystemExit) as ended:
            program.main()
        assert ended.value.code == 2
        assert said in capsys.readouterr().err
