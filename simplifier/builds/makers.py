"""Makers on other machines, by the address that they are asked at.

A package above this one adds them by an entry point of the group :data:`GROUP`, whose name is the
scheme of an address and whose object is called with the address, an API key or None, and an event
that ends the work once it is set; it returns a context manager of a
:data:`~simplifier.builds.making.Maker` that is safe to call from several threads.
"""

from __future__ import annotations

import threading
from contextlib import AbstractContextManager
from importlib.metadata import entry_points

from simplifier.builds.making import Job, Maker
from simplifier.errors import OptionError

__all__ = ["GROUP", "Job", "Maker", "maker_at"]

GROUP = "occluder.makers"


def maker_at(address: str, key: str | None, stop: threading.Event) -> AbstractContextManager[Maker]:
    """Raises :class:`OptionError` for an address that nobody is asked at."""
    scheme = address.partition("://")[0].lower() if "://" in address else ""
    known = {one.name: one for one in entry_points(group=GROUP)}
    if scheme not in known:
        raise OptionError(
            f"'{address}' is no address of a service",
            where="server",
            remedy="write as in http://127.0.0.1:8000"
            if known
            else "run: pip install 'planar-occluder[service]'",
        )
    found: AbstractContextManager[Maker] = known[scheme].load()(address, key, stop)
    return found
