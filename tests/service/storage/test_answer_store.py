"""The same request is done once, and what it did and its answer are one transaction."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from service.access.key import Scope
from service.errors import IdempotencyKeyReusedError, NotFoundError, RequestUnderWayError
from service.idempotency import KEPT_SECONDS, Answer, KeyedRequest
from service.storage.answer_store import SqlAnswerStore
from service.storage.database import Database
from service.storage.key_store import SqlKeyStore
from tests.service.storage.samples import Clock

ASKED = KeyedRequest("studio", "k1", "f" * 64)
ANSWER = Answer(201, {"Location": "/there"}, b"made", "j" * 32)


@pytest.fixture
def answers(database: Database, clock: Clock) -> SqlAnswerStore:
    return SqlAnswerStore(database, clock)


def never() -> Answer:
    raise AssertionError("it is done once")


def test_the_same_request_is_done_once_and_answered_as_it_was(
    answers: SqlAnswerStore, clock: Clock
) -> None:
    assert not answers.known("studio", "k1")
    assert answers.once(ASKED, lambda: ANSWER) == (ANSWER, False)
    clock.now += KEPT_SECONDS - 1.0
    assert answers.once(ASKED, never) == (ANSWER, True)
    assert answers.known("studio", "k1")


def test_a_key_is_forgotten_after_a_day(answers: SqlAnswerStore, clock: Clock) -> None:
    answers.once(ASKED, lambda: ANSWER)
    clock.now += KEPT_SECONDS
    assert not answers.known("studio", "k1")
    other = Answer(204)
    assert answers.once(ASKED, lambda: other) == (other, False)
    assert answers.once(ASKED, never) == (other, True)
    assert answers.expire(clock.now) == 0
    assert answers.expire(clock.now + 1.0) == 1
    assert answers.once(ASKED, lambda: ANSWER) == (ANSWER, False)


def test_another_request_under_the_key_is_refused_and_another_tenants_is_none(
    answers: SqlAnswerStore,
) -> None:
    answers.once(ASKED, lambda: ANSWER)
    with pytest.raises(IdempotencyKeyReusedError, match="k1"):
        answers.once(KeyedRequest("studio", "k1", "0" * 64), never)
    theirs = Answer(200, {}, b"theirs")
    assert answers.once(KeyedRequest("rival", "k1", "0" * 64), lambda: theirs) == (theirs, False)


def test_what_is_refused_leaves_nothing_and_frees_the_key(
    answers: SqlAnswerStore, keys: SqlKeyStore
) -> None:
    told: list[str] = []

    def refuse() -> Answer:
        keys.create("studio", "ci", Scope.READ)
        answers.afterwards(lambda: told.append("made"))
        raise NotFoundError("it is not there")

    with pytest.raises(NotFoundError):
        answers.once(ASKED, refuse)
    assert (keys.keys(), told) == ([], [])
    assert answers.once(ASKED, lambda: ANSWER) == (ANSWER, False)


def test_what_is_to_be_told_is_told_after_the_commit(
    answers: SqlAnswerStore, keys: SqlKeyStore
) -> None:
    seen: list[int] = []

    def look() -> None:
        with ThreadPoolExecutor(1) as others:
            seen.append(len(others.submit(keys.keys).result()))

    def work() -> Answer:
        keys.create("studio", "ci", Scope.READ)
        assert len(keys.keys()) == 1  # one sees what one has written
        look()  # and nobody else does
        answers.afterwards(look)
        return ANSWER

    answers.once(ASKED, work)
    answers.afterwards(look)
    assert seen == [0, 1, 1]


def test_a_step_that_fails_and_is_caught_leaves_nothing_of_it(
    answers: SqlAnswerStore, database: Database, keys: SqlKeyStore
) -> None:
    def half() -> None:
        with database.writing() as session:
            session.execute(text("UPDATE api_keys SET name = 'half'"))
            session.execute(text("UPDATE api_keys SET scope = 'root'"))

    def work() -> Answer:
        kept, _ = keys.create("studio", "kept", Scope.READ)
        with pytest.raises(IntegrityError):
            half()
        return Answer(200, {}, kept.id.encode())

    answers.once(ASKED, work)
    assert [key.name for key in keys.keys()] == ["kept"]  # noqa: SIM118 - a store, no dictionary


def test_the_same_request_is_refused_while_it_is_worked_on(answers: SqlAnswerStore) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def work() -> Answer:
        begun.set()
        assert go_on.wait(10.0)
        return ANSWER

    with ThreadPoolExecutor(1) as others:
        first = others.submit(answers.once, ASKED, work)
        assert begun.wait(10.0)
        with pytest.raises(RequestUnderWayError) as refused:
            answers.once(ASKED, never)
        assert refused.value.headers == {"Retry-After": "1"}
        go_on.set()
        assert first.result() == (ANSWER, False)
    assert answers.once(ASKED, never) == (ANSWER, True)


def test_the_database_decides_between_those_who_know_nothing_of_each_other(
    database: Database, keys: SqlKeyStore, clock: Clock
) -> None:
    """Each store stands for a process: what one knows to be under way, others do not."""

    def work() -> Answer:
        return Answer(201, {}, keys.create("studio", "ci", Scope.READ)[0].id.encode())

    at_once = threading.Barrier(8)

    def ask(_: int) -> tuple[Answer, bool]:
        store = SqlAnswerStore(database, clock)
        at_once.wait(10.0)
        while True:
            with suppress(RequestUnderWayError):  # who shares the database may tell so
                return store.once(ASKED, work)

    with ThreadPoolExecutor(8) as pool:
        given = list(pool.map(ask, range(8)))
    assert [replayed for _, replayed in given].count(False) == 1
    [made] = keys.keys()
    assert {answer.body for answer, _ in given} == {made.id.encode()}
