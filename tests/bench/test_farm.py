"""The simulated night against what can be told by hand."""

from __future__ import annotations

import pytest

from bench.farm import Farm, processors_for, simulate

NEVER = 1e12


def test_without_losses_and_database_it_is_a_division():
    night = simulate(Farm([2.0], 0.5, 0.0, lost_every=NEVER), 1000, 10)
    assert night.hours * 3600.0 == pytest.approx(250.0)
    assert night.repeated == 0


def test_where_the_database_is_slower_than_the_processors_it_sets_the_pace():
    night = simulate(Farm([1.0], 0.0, 0.5, lost_every=NEVER), 400, 1000)
    assert night.hours * 3600.0 == pytest.approx(200.0, rel=0.02)
    assert night.database_busy == pytest.approx(1.0, rel=0.02)


def test_what_a_lost_node_did_is_done_again():
    """One of two nodes is lost once, with the jobs of its four processors, for two jobs' time."""
    farm = Farm([10.0], 0.0, 0.0, node=4, lost_every=105.0, away=20.0)
    night = simulate(farm, 8 * 12, 8)
    assert night.repeated == 4
    assert night.hours * 3600.0 > 120.0


def test_the_fewest_nodes_that_are_done_in_time():
    farm = Farm([1.0, 3.0], 0.0, 0.0, node=2, lost_every=NEVER)
    processors, night = processors_for(farm, 9000, 1.0)  # of which five do nearly that
    assert processors == 6
    assert night.hours <= 1.0
    assert simulate(farm, 9000, 4).hours > 1.0
