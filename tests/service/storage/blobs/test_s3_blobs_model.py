"""Instances that share a bucket, step by step in any order: held up, killed, taken for dead.

Each upload, sweep and read is an actor, a thread that stops before and after every transaction and
every request to the bucket.  One of them runs at a time, when the model says so.
"""

from __future__ import annotations

import io
import itertools
import random
import threading
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from inspect import isgenerator

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    rule,
    run_state_machine_as_test,
)
from sqlalchemy import delete

from service.errors import HoldLostError
from service.jobs.job import Blob
from service.storage.blobs import ownership
from service.storage.blobs.ledger import BlobLedger, rely_on
from service.storage.blobs.s3_blobs import BucketParts, S3Blobs
from service.storage.blobs.sweeping import BucketSweep
from service.storage.blobs.tables import (
    BlobHoldRow,
    BlobIdentityRow,
    BlobObjectRow,
    BlobOwnerRow,
)
from service.storage.database import Database
from tests.service.storage.blobs.blob_store_contract import blob_of
from tests.service.storage.blobs.s3_stores import keys_in, memory_bucket
from tests.service.storage.samples import Clock

LEASE = 100.0
CONTENTS = [b"a", b"bb"]
whose = st.integers(0, 1)
IDENTITY = "of this bucket"
WEIGHTS = {"step": 12, "forget": 3, "adopt": 3, "sweep": 2, "renew": 2, "upload": 2, "read": 1}
"""How often something happens."""


class KilledError(BaseException):
    """The process of the actor is no more: nothing that it does has an effect."""


class Actor:
    """Something that an instance does, in a thread that runs only within :meth:`step`."""

    current = threading.local()

    def __init__(self, work: Callable[[], None]) -> None:
        self._work = work
        self._go, self._stopped = threading.Semaphore(0), threading.Semaphore(0)
        self._killed = False
        self.ended = False
        self.error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        Actor.current.actor = self
        try:
            self.gate()
            self._work()
        except KilledError:
            pass
        except BaseException as error:
            self.error = error
        self.ended = True
        self._stopped.release()

    def gate(self) -> None:
        """In the thread: wait for the next step."""
        if not self._killed:
            self._stopped.release()
            self._go.acquire()
        if self._killed:
            raise KilledError

    def step(self) -> None:
        if not self.ended:
            self._stopped.acquire()
            self._go.release()
            # It has stopped again, or ended, once this can be taken; left for the next step.
            self._stopped.acquire()
            self._stopped.release()
        if self.error is not None:
            raise self.error

    def kill(self) -> None:
        if not self.ended:
            self._stopped.acquire()
            self._killed = True
            self._go.release()
            self._thread.join(10)
            assert self.ended


class Stepped:
    """A ledger or a bucket, around each call of which an actor stops."""

    def __init__(self, inner: object) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> object:
        found = getattr(self._inner, name)
        if not callable(found):
            return found

        def call(*given: object, **named: object) -> object:
            stop()
            result = found(*given, **named)
            stop()
            return some_at_a_time(result) if isgenerator(result) else result

        return call


def stop() -> None:
    """Here an actor stops; whoever is none goes on."""
    actor = getattr(Actor.current, "actor", None)
    if actor is not None:
        actor.gate()


def some_at_a_time(items: Iterator[object]) -> Iterator[object]:
    for item in items:
        yield item
        stop()


class Instance:
    """A server, until it is killed; then another one in its place."""

    def __init__(self, model: SharedBucket) -> None:
        self._model = model
        self.actors: list[Actor] = []
        self.silences = 0
        self.begin()

    def begin(self) -> None:
        model = self._model
        parts = BucketParts.of(Stepped(model.bucket), Stepped(model.ledger), IDENTITY)
        self.store, self.ownership = S3Blobs(parts, None), parts.ownership
        self.renewed = model.clock.now
        self.sweeper: Actor | None = None
        self.reading: Counter[bytes] = Counter()

    def kill(self) -> None:
        held_up = any(not actor.ended for actor in self.actors)
        self._model.may_stray |= held_up and (self.silent or self.silences > 0)
        for actor in self.actors:
            actor.kill()
        self.actors.clear()
        self.begin()

    @property
    def silent(self) -> bool:
        """For longer than its lease."""
        return self._model.clock.now - self.renewed > LEASE

    def renew(self) -> None:
        self.silences += self.silent
        self.ownership.show_life()
        self.renewed = self._model.clock.now


class SharedBucket(RuleBasedStateMachine):
    def __init__(self, database: Database) -> None:
        super().__init__()
        self.database = database
        with database.writing() as session:
            for table in (BlobHoldRow, BlobOwnerRow, BlobObjectRow, BlobIdentityRow):
                session.execute(delete(table))
        self.clock = Clock()
        self.ledger = BlobLedger(database, self.clock, LEASE)
        self.bucket = memory_bucket()
        self.bucket.write_identity(IDENTITY)
        self.rows: Counter[bytes] = Counter()
        self.may_stray = False
        self.instances = [Instance(self), Instance(self)]

    # What actors do.

    def upload(self, instance: Instance, data: bytes, adopts: bool) -> None:
        silences = instance.silences
        try:
            with instance.store.keeping() as keeping:
                if adopts:
                    blob = blob_of(data)
                    try:
                        keeping.adopt(blob)
                    except KeyError:
                        return
                else:
                    blob = keeping.put(io.BytesIO(data))
                stop()
                self.name(data, blob)
                stop()
        except HoldLostError:
            # Never without reason.
            assert instance.silent or instance.silences > silences

    def name(self, data: bytes, blob: Blob) -> None:
        with self.database.writing() as session:
            rely_on(session, [blob])
        self.rows[data] += 1

    def sweep(self, instance: Instance) -> None:
        instance.store.sweep(self.unnamed)

    def unnamed(self, digests: Collection[str]) -> set[str]:
        stop()
        named = sum((instance.reading for instance in self.instances), +self.rows)
        found = set(digests) - {blob_of(data).digest for data in named}
        stop()
        return found

    def read(self, instance: Instance, data: bytes) -> None:
        """What a row names all the time is there for whoever takes all the time."""
        try:
            with instance.store.open(blob_of(data)) as reader:
                found = b""
                while piece := reader.read(1):
                    found += piece
                    stop()
            assert found == data
        finally:
            instance.reading[data] -= 1

    # What happens.

    def begin(self, instance: Instance, work: Callable[[], None]) -> Actor | None:
        """Unless there are enough."""
        instance.actors = [actor for actor in instance.actors if not actor.ended]
        if len(instance.actors) == 3:
            return None
        instance.actors.append(Actor(work))
        return instance.actors[-1]

    def begin_upload(self, instance: Instance, data: bytes, adopts: bool) -> None:
        self.begin(instance, lambda: self.upload(instance, data, adopts))

    def begin_sweep(self, instance: Instance) -> None:
        if instance.sweeper is None or instance.sweeper.ended:  # one has no second at once
            instance.sweeper = self.begin(instance, lambda: self.sweep(instance))

    def begin_read(self, instance: Instance, data: bytes) -> None:
        if self.rows[data] and self.begin(instance, lambda: self.read(instance, data)):
            instance.reading[data] += 1

    @rule(seed=st.integers(0, 2**32))
    def go_on(self, seed: int) -> None:
        """Whoever is there goes on for a while, others come, and rows go."""
        chance = random.Random(seed)
        for _ in range(15):
            instance, data = chance.choice(self.instances), chance.choice(CONTENTS)
            match chance.choices(list(WEIGHTS), list(WEIGHTS.values()))[0]:
                case "upload":
                    self.begin_upload(instance, data, adopts=False)
                case "adopt":
                    self.begin_upload(instance, data, adopts=True)
                case "sweep":
                    self.begin_sweep(instance)
                case "read":
                    self.begin_read(instance, data)
                case "forget":
                    self.rows[data] = 0
                case "renew":
                    instance.renew()
                case "step":
                    going = [actor for actor in instance.actors if not actor.ended]
                    if going:
                        actor = chance.choice(going)
                        # Much happens while a sweep is in the midst of something.
                        slow = actor is instance.sweeper
                        for _ in range(chance.choice([1, 2, 3] if slow else [1, 3, 9])):
                            actor.step()

    def advance(self, instance: Instance, steps: int = 10**9) -> None:
        """The actors of an instance, one after the other."""
        for actor in instance.actors:
            while steps and not actor.ended:
                actor.step()
                steps -= 1

    @rule(pause=st.sampled_from([0.0, 0.5, 2.0]), silent=st.sets(whose), killed=st.sets(whose))
    def interrupt(self, pause: float, silent: set[int], killed: set[int]) -> None:
        for which in killed:
            self.instances[which].kill()
        self.pass_time(pause, silent)

    def pass_time(self, pause: float, silent: set[int]) -> None:
        """So many leases; who is silent meanwhile is taken for dead, or not."""
        self.clock.now += LEASE * pause
        for which in {0, 1} - silent:
            self.instances[which].renew()

    @invariant()
    def what_a_row_names_is_there(self) -> None:
        for data in +self.rows:
            key = self.ledger.key_of(blob_of(data))
            assert bytes(self.bucket.get(key, 0, 2000)) == data

    def teardown(self) -> None:
        try:
            self.end()
        finally:
            for instance in self.instances:
                instance.kill()

    def end(self) -> None:
        """Whoever is there comes to an end, whatever happened; then two sweeps leave no more than
        is named."""
        for instance in self.instances:
            self.advance(instance)
            instance.kill()
        self.clock.now += 3 * LEASE
        self.leave_what_is_named()
        self.rows.clear()
        self.leave_what_is_named()
        with self.database.reading() as session:
            for table in (BlobHoldRow, BlobOwnerRow, BlobObjectRow):
                assert session.query(table).count() == 0

    def leave_what_is_named(self) -> None:
        sweep = BucketSweep(self.bucket, self.ledger, IDENTITY)
        for _ in range(2):
            sweep.run(self.unnamed)
        if self.may_stray:
            sweep.remove_strays()
        self.what_a_row_names_is_there()
        keys = {self.ledger.key_of(blob_of(data)) for data in +self.rows}
        assert keys_in(self.bucket) == keys


def beside_slow(*cases: tuple[object, ...]) -> list[object]:
    """The first half of some cases, and the others for whoever asks for what takes long."""
    half = len(cases) // 2
    return [*cases[:half], *(pytest.param(*case, marks=pytest.mark.slow) for case in cases[half:])]


@pytest.mark.parametrize(
    ("kind", "examples", "steps"),
    beside_slow(("sqlite", 5, 30), ("postgres", 3, 20), ("sqlite", 40, 50), ("postgres", 20, 40)),
)
def test_any_order(kind, request, monkeypatch, examples, steps):
    database = request.getfixturevalue(f"{kind}_database")
    monkeypatch.setattr(ownership, "_KEYS", 2)
    run_state_machine_as_test(
        lambda: SharedBucket(database),
        settings=settings(max_examples=examples, stateful_step_count=steps, deadline=None),
    )


# Somebody comes to rely on a blob that no row names, and another sweeps: after how many steps each
# is held up, whether he is taken for dead by then, and how it ends.
HELD_UP = list(
    itertools.product(
        range(10), (0.0, 2.0), range(27), (True, False),
        ("relying first", "sweep first", "sweeper killed", "other killed"),
    )
)  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "every"),
    beside_slow(("sqlite", 97), ("postgres", 211), ("sqlite", 2), ("postgres", 13)),
)
def test_two_that_are_held_up(kind, request, monkeypatch, every):
    database = request.getfixturevalue(f"{kind}_database")
    monkeypatch.setattr(ownership, "_KEYS", 1)
    for case in HELD_UP[::every]:
        model = SharedBucket(database)
        try:
            meet(model, *case)
        except BaseException as error:
            error.add_note(str(case))
            raise
        finally:
            for instance in model.instances:
                instance.kill()


def meet(
    model: SharedBucket, steps: int, pause: float, sweep_steps: int, adopts: bool, ending: str
) -> None:
    (data, _), (sweeper, other) = CONTENTS, model.instances
    model.upload(sweeper, data, adopts=False)
    model.rows.clear()
    sweeper.renew()
    model.begin_upload(other, data, adopts)
    model.advance(other, steps)
    model.pass_time(pause, {1})
    model.begin_sweep(sweeper)
    model.advance(sweeper, sweep_steps)
    match ending:
        case "sweep first":
            model.advance(sweeper)
        case "sweeper killed":
            sweeper.kill()
        case "other killed":
            other.kill()
    model.advance(other)
    model.advance(sweeper)
    model.what_a_row_names_is_there()
    model.clock.now += 3 * LEASE
    model.leave_what_is_named()
