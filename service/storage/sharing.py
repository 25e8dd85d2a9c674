"""What servers that share a database have of each other: who leads, and news."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass

from service.storage.database import Database, Topic

Heard = Callable[[Topic, str], None]
"""Called in a thread with each piece of news, and what goes with it."""


@dataclass(frozen=True)
class Sharing:
    """``shared``     whether there may be others.
    ``leads``      whether this server does what one alone has to do.
    ``listening``  a block in which news are heard; its second argument is called whenever some may
                   have been missed.
    """

    shared: bool
    leads: Callable[[], bool]
    listening: Callable[[Heard, Callable[[], None]], AbstractContextManager[None]]


ALONE = Sharing(False, lambda: True, lambda heard, missed: nullcontext())
"""A server that has its database for itself."""


@contextmanager
def sharing(database: Database, *, may_lead: bool = True) -> Iterator[Sharing]:
    """With the others of a database, while the block lasts.

    ``may_lead``  whether this one does what a leader has to.
    """
    if not database.shared:
        yield ALONE
        return
    from service.storage.leadership import Leadership
    from service.storage.postgres import Listener, PostgresDatabase

    assert isinstance(database, PostgresDatabase)
    place, leadership = database.place, Leadership(database.place)
    with leadership.running() if may_lead else nullcontext():
        yield Sharing(
            True,
            leadership.held,
            lambda heard, missed: Listener(place, heard, missed).running(),
        )
