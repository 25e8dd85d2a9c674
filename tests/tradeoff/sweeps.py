"""Made-up results of a sweep: figures that are easy to reason about."""

from __future__ import annotations

from simplifier.options.tradeoff import TradeoffOptions
from simplifier.tradeoff.study import study_of
from simplifier.tradeoff.sweep import Setting, Trial

HOSTILE = "\"><script>alert('1')</script> & {{ 7 * 7 }} {% raw %} <img src=x onerror=1>,\n=1+1.obj"

SMALL = TradeoffOptions(
    resolutions=(32, 128), directions=(16,), budgets=(16,), times=(1.0, 2.0), repeats=1
)


def trial(setting, seconds, recall, precision=0.999, mesh="a.obj", **more):
    more = {"overhang": 0.0042, **more}
    return Trial(mesh, setting, seconds, setting.budget, precision, recall, **more)


def plain_trials(mesh="a.obj", budget=16, slower=1.0):
    """Time is worth five points a doubling, directions cost nothing and bring nothing.

    The front is draft, time 1, time 2; balanced costs as much as 16 directions and recalls the
    same, so both are on it; resolution 128 is dominated and resolution 32 too imprecise.
    """
    at = Setting
    figures = [
        (at(budget, "draft"), 0.5, 0.48, 0.999),
        (at(budget), 1.0, 0.5, 0.999),
        (at(budget, "best"), 8.0, 0.53, 0.999),
        (at(budget, resolution=32), 0.8, 0.9, 0.98),
        (at(budget, resolution=128), 3.0, 0.52, 1.0),
        (at(budget, directions=16), 1.0, 0.5, 0.999),
        (at(budget, time=1.0), 2.0, 0.55, 0.999),
        (at(budget, time=2.0), 4.0, 0.6, 0.999),
    ]
    return [trial(s, slower * t, r, p, mesh) for s, t, r, p in figures]


def study(trials=None, precision=0.99, options=SMALL):
    return study_of(plain_trials() if trials is None else trials, options, precision)
