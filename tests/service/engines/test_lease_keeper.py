"""Leases are renewed in time, whether or not anybody wakes their keeper."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import pytest

from service.engines import lease_keeper
from service.engines.lease_keeper import LeaseKeeper
from service.engines.signals import Bell, Running
from service.engines.trouble import StoppedError, Trouble


class Clock:
    """Seconds that pass only while somebody waits; all waiting ends once so many have passed."""

    def __init__(self, end):
        self.now, self.end = 0.0, end

    def monotonic(self):
        return self.now

    def wait(self, seconds):
        self.now += seconds

    def pause(self, seconds):
        self.now += seconds
        if self.now >= self.end:
            raise StoppedError


# A lease of one second was once renewed every 1.1 s, and its job begun again.
@pytest.mark.parametrize("lease_seconds", [1.0, 1.5, 3.0, 30.0])
@pytest.mark.parametrize("shared", [False, True])
def test_leases_are_renewed_in_time_though_nobody_wakes_their_keeper(
    lease_seconds, shared, monkeypatch
):
    clock, renewed, running, trouble = Clock(4.0 * lease_seconds), [], Running(), Trouble()
    monkeypatch.setattr(lease_keeper, "time", clock)
    monkeypatch.setattr(Bell, "wait", lambda self, seconds: clock.wait(seconds))
    monkeypatch.setattr(trouble, "pause", clock.pause)

    def renew(claims, seconds):
        assert [claim.job.id for claim in claims] == ["one"]
        assert seconds == lease_seconds
        renewed.append(clock.now)
        return {"one": False}

    jobs = SimpleNamespace(renew=renew, cancelled=lambda claims: frozenset())
    settings = SimpleNamespace(lease_seconds=lease_seconds)
    shop = SimpleNamespace(
        jobs=jobs, settings=settings, running=running, trouble=trouble, bell=Bell()
    )
    with running.at(SimpleNamespace(job=SimpleNamespace(id="one"))) as orders:
        LeaseKeeper(shop, shared=shared).run(lambda: None, lambda: None)
    assert not orders.dropped
    between = [late - soon for soon, late in pairwise(renewed)]
    assert max(between) <= lease_seconds / 2
    assert len(renewed) >= 8
