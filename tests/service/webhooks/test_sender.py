"""Receivers hear of jobs that have ended, whatever else happens."""

from __future__ import annotations

import json
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from service.errors import DiskFullError, NotFoundError
from service.jobs.deliveries import Delivery, SecretAge
from service.settings import Settings
from service.webhooks.rotation import CurrentSecrets
from service.webhooks.sender import WebhookSender
from service.webhooks.signing import SignatureError, verify
from service.webhooks.tenant_secrets import TenantSecrets
from tests.service.storage.samples import Clock
from tests.service.webhooks.receivers import Ages, Deliveries, Names, receiving
from tests.waiting import until

SECRETS = TenantSecrets(b"m" * 32)
AGES = Ages()
CURRENT = CurrentSecrets(SECRETS, AGES)
ENDED = "2024-05-01T12:00:00Z"


def describe(delivery: Delivery) -> Mapping[str, Any]:
    return {"id": delivery.job_id, "state": "succeeded", "ended": ENDED}


@contextmanager
def sending(
    deliveries: Deliveries,
    *,
    tell: Callable[[Delivery], Mapping[str, Any]] = describe,
    names: Names | None = None,
    **settings: Any,
) -> Iterator[WebhookSender]:
    chosen = Settings(**{"webhook_private": True, **settings})
    sender = WebhookSender(deliveries, tell, CURRENT, chosen, resolve=names)
    sender.start()
    try:
        yield sender
    finally:
        sender.stop()


def test_a_receiver_hears_of_the_job_signed_with_its_tenants_secret() -> None:
    deliveries = Deliveries()
    with receiving() as receiver:
        deliveries.add(receiver.url, "d7", "studio", "j9")
        with sending(deliveries):
            until(lambda: deliveries.notes)
    (heard,) = receiver.heard
    assert json.loads(heard.body) == {
        "event": "job.ended",
        "id": "d7",
        "created": ENDED,
        "job": {"id": "j9", "state": "succeeded", "ended": ENDED},
    }
    assert heard.headers["content-type"] == "application/json"
    assert heard.headers["occluder-event"] == "job.ended"
    assert heard.headers["occluder-delivery"] == "d7"
    verify(SECRETS.of("studio"), heard.headers, heard.body)
    with pytest.raises(SignatureError):
        verify(SECRETS.of("other"), heard.headers, heard.body)
    assert deliveries.notes == [("delivered", "d7", "")]


def test_a_word_goes_out_as_soon_as_the_sender_is_woken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.webhooks.sender._GLANCE", 600.0)  # no look by itself
    deliveries = Deliveries()
    with receiving() as receiver, sending(deliveries) as sender:
        until(lambda: deliveries.looks)
        deliveries.add(receiver.url)
        sender.wake()
        until(lambda: deliveries.notes)


def test_a_receiver_that_fails_is_tried_again_with_the_same_word() -> None:
    deliveries = Deliveries()
    with receiving((500, {}), (503, {"Retry-After": "77"})) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries) as sender:
            for tries in (1, 2, 3):
                until(lambda tries=tries: len(deliveries.notes) == tries)
                deliveries.now += 3600.0
                sender.wake()
    assert [note[0] for note in deliveries.notes] == ["postponed", "postponed", "delivered"]
    assert "500" in deliveries.notes[0][2]
    assert deliveries.waits[1] == 77.0
    assert len({heard.body for heard in receiver.heard}) == 1
    assert {heard.headers["occluder-delivery"] for heard in receiver.heard} == {"d1"}


def test_a_receiver_is_given_up_after_the_allowed_tries() -> None:
    deliveries = Deliveries()
    with receiving(*[(500, {})] * 9) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries, webhook_attempts=3) as sender:
            for tries in (1, 2, 3):
                until(lambda tries=tries: len(deliveries.notes) == tries)
                deliveries.now += 3600.0
                sender.wake()
    assert [note[0] for note in deliveries.notes] == ["postponed", "postponed", "given up"]
    assert len(receiver.heard) == 3


def test_a_receiver_that_is_gone_is_given_up_at_once() -> None:
    deliveries = Deliveries()
    with receiving((410, {})) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries):
            until(lambda: deliveries.notes)
    assert deliveries.of("given up") == ["d1"]


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_a_redirect_is_not_followed(status: int) -> None:
    deliveries = Deliveries()
    with receiving() as inside:
        with receiving((status, {"Location": inside.url})) as receiver:
            deliveries.add(receiver.url)
            with sending(deliveries):
                until(lambda: deliveries.notes)
        assert not inside.heard
    assert deliveries.of("postponed") == ["d1"]
    assert str(status) in deliveries.notes[0][2]


def test_loopback_is_refused_unless_it_is_allowed() -> None:
    deliveries = Deliveries()
    with receiving() as receiver:
        deliveries.add(receiver.url, "plain")
        deliveries.add(f"http://localhost:{receiver.port}/", "by name")
        deliveries.add(f"http://2130706433:{receiver.port}/", "by number")
        deliveries.add(f"http://hook.example:{receiver.port}/", "rebound")
        names = Names({name: ["127.0.0.1"] for name in ("127.0.0.1", "2130706433", "hook.example")})
        with sending(deliveries, names=names, webhook_private=False):
            until(lambda: len(deliveries.notes) == 4)
        assert not receiver.heard
    assert len(deliveries.of("postponed")) == 4


def test_nobody_listening_is_no_end_of_the_sender() -> None:
    deliveries = Deliveries()
    deliveries.add("http://127.0.0.1:9/hook", "closed")
    deliveries.add("http://[broken", "broken")
    deliveries.add("no url at all", "no url")
    with receiving() as receiver:
        deliveries.add(receiver.url, "well")
        with sending(deliveries):
            until(lambda: len(deliveries.notes) == 4)
    assert deliveries.of("delivered") == ["well"]
    reasons = [reason for kind, _, reason in deliveries.notes if kind == "postponed"]
    assert len(reasons) == 3
    assert all(reasons)
    assert not any("127.0.0.1" in reason for reason in reasons)


def test_a_slow_receiver_holds_up_nobody_else() -> None:
    deliveries = Deliveries()
    with receiving() as slow, receiving() as quick:
        slow.gate.clear()
        for number in range(40):
            deliveries.add(slow.url, f"slow {number}", f"tenant {number}")
        for number in range(10):
            deliveries.add(quick.url, f"quick {number}", "other")
        with sending(deliveries):
            until(lambda: len(deliveries.of("delivered")) == 10)
            assert {heard.path for heard in quick.heard} == {"/hook"}
            assert len(slow.heard) <= 4
            slow.gate.set()
            until(lambda: len(deliveries.of("delivered")) == 50)


def test_a_tenant_with_many_slow_receivers_holds_up_no_other() -> None:
    deliveries = Deliveries()
    hosts = ["quick.example", *(f"h{number}.example" for number in range(80))]
    names = Names({host: ["127.0.0.1"] for host in hosts})
    with receiving() as slow, receiving() as quick:
        slow.gate.clear()
        for number in range(80):
            url = f"http://h{number}.example:{slow.port}/"
            deliveries.add(url, f"slow {number}", "greedy")
        deliveries.add(f"http://quick.example:{quick.port}/", "quick", "other")
        with sending(deliveries, names=names):
            until(lambda: deliveries.of("delivered") == ["quick"])
            assert len(slow.heard) <= 16


def test_a_receiver_that_does_not_answer_in_time_is_left() -> None:
    deliveries = Deliveries()
    with receiving() as receiver:
        receiver.gate.clear()
        deliveries.add(receiver.url)
        with sending(deliveries, webhook_seconds=0.2):
            until(lambda: deliveries.notes)
    assert deliveries.notes == [("postponed", "d1", "no answer within 0.2 seconds")]


def test_an_answer_that_never_ends_is_not_read_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.webhooks.posting._READ_SECONDS", 1000.0)
    deliveries = Deliveries()
    with receiving((200, {}), endless=True) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries):
            until(lambda: deliveries.of("delivered"))


def test_an_answer_that_breaks_off_after_its_status_is_one() -> None:
    deliveries = Deliveries()
    with receiving((200, {"Content-Length": "1000"})) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries):
            until(lambda: deliveries.of("delivered"))


def test_a_stop_does_not_wait_for_receivers() -> None:
    deliveries = Deliveries()
    with receiving() as receiver:
        receiver.gate.clear()
        deliveries.add(receiver.url)
        with sending(deliveries) as sender:
            until(lambda: receiver.heard)
            sender.stop()
        assert not deliveries.notes  # which an answer, or the end of waiting for it, would be
        assert "webhooks" not in {thread.name for thread in threading.enumerate()}
        receiver.gate.set()
        with sending(deliveries):
            until(lambda: deliveries.of("delivered"))
    assert [heard.headers["occluder-delivery"] for heard in receiver.heard] == ["d1", "d1"]


def test_it_may_be_woken_and_stopped_at_any_time() -> None:
    sender = WebhookSender(Deliveries(), describe, CURRENT, Settings())
    sender.wake()
    sender.stop()
    sender.start()
    sender.stop()
    sender.wake()
    sender.stop()


def test_a_full_disk_delays_the_note_and_repeats_no_word(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.webhooks.sender._STORE_PAUSE", 0.02)
    deliveries = Deliveries()
    with receiving() as receiver:
        receiver.gate.clear()
        deliveries.add(receiver.url)
        with sending(deliveries):
            until(lambda: receiver.heard)
            deliveries.fault = DiskFullError("no room")
            receiver.gate.set()
            until(lambda: deliveries.faults >= 5)
            deliveries.fault = None
            until(lambda: deliveries.of("delivered"))
    assert len(receiver.heard) == 1


def test_a_store_that_breaks_does_not_end_the_sender(caplog: pytest.LogCaptureFixture) -> None:
    deliveries = Deliveries()
    deliveries.fault = ZeroDivisionError("a fault of ours")
    with receiving() as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries) as sender:
            until(lambda: "a fault of ours" in caplog.text)
            deliveries.fault = None
            sender.wake()
            until(lambda: deliveries.of("delivered"))


def test_a_job_that_is_forgotten_is_told_no_more() -> None:
    def forgotten(delivery: Delivery) -> Mapping[str, Any]:
        raise NotFoundError("there is no such job")

    deliveries = Deliveries()
    with receiving() as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries, tell=forgotten):
            until(lambda: deliveries.of("given up"))
        assert not receiver.heard


def test_a_job_that_cannot_be_described_counts_as_a_try() -> None:
    def broken(delivery: Delivery) -> Mapping[str, Any]:
        raise KeyError("ended")

    deliveries = Deliveries()
    with receiving() as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries, tell=broken):
            until(lambda: deliveries.of("postponed"))


def test_the_log_holds_no_url(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    deliveries = Deliveries()
    with receiving((500, {})) as receiver:
        deliveries.add(f"{receiver.url}?token=hush")
        with sending(deliveries):
            until(lambda: deliveries.notes)
    assert f"127.0.0.1:{receiver.port}" in caplog.text
    assert "hush" not in caplog.text


def test_both_secrets_sign_while_one_is_rotated() -> None:
    ages, deliveries = Ages(), Deliveries()
    clock = Clock()
    secrets = CurrentSecrets(SECRETS, ages, clock)
    before, other = secrets.of("studio"), secrets.of("other")
    ages.of["studio"] = SecretAge(1, clock.now + 60.0)
    with receiving() as receiver:
        sender = WebhookSender(deliveries, describe, secrets, Settings(webhook_private=True))
        sender.start()
        deliveries.add(receiver.url, "during")
        sender.wake()
        until(lambda: len(receiver.heard) == 1)
        clock.now += 60.0
        deliveries.add(receiver.url, "after")
        sender.wake()
        until(lambda: len(receiver.heard) == 2)
        sender.stop()
    during, after = receiver.heard
    (new,) = secrets.of("studio")
    assert new != before[0]
    for secret in (*before, new):
        verify(secret, during.headers, during.body)
    assert during.headers["occluder-signature"].count("v1=") == 2
    verify(new, after.headers, after.body)
    with pytest.raises(SignatureError):
        verify(before[0], after.headers, after.body)
    assert secrets.of("other") == other


def test_a_try_is_noted_with_its_time_and_status() -> None:
    deliveries = Deliveries()
    with receiving((500, {"Content-Type": "text/plain"})) as receiver:
        deliveries.add(receiver.url)
        with sending(deliveries) as sender:
            until(lambda: len(deliveries.notes) == 1)
            deliveries.now += 3600.0
            sender.wake()
            until(lambda: len(deliveries.notes) == 2)
    first, second = deliveries.attempts
    assert (first.status, first.reason) == (500, "the receiver answered 500")
    assert (second.status, second.reason) == (204, "")
    assert first.at <= second.at <= time.time()
    assert 0.0 < first.milliseconds < 20_000.0
    assert first.excerpt is None  # of loopback nothing is shown
