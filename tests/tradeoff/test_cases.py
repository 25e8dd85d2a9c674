"""Fronts and advice from figures that were made up, so that the answers are known."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from simplifier.errors import OptionError
from simplifier.tradeoff import words
from simplifier.tradeoff.advice import advise
from simplifier.tradeoff.cases import judge_cases
from simplifier.tradeoff.sweep import Setting, Trial, outcomes
from simplifier.wording import short_seconds
from tests.tradeoff.sweeps import plain_trials, study, trial


def cases_of(trials, precision=0.99):
    return judge_cases(outcomes(trials), precision)


def verdicts(case):
    return {item.setting.name: item.verdict for item in case.judged}


def knob(advice, name):
    return next(item for item in advice.knobs if item.knob == name)


def test_standings_of_a_mesh():
    (case,) = cases_of(plain_trials())
    assert [item.setting.name for item in case.front] == [
        "draft", "balanced", "16 directions", "time 1 s", "time 2 s",
    ]  # fmt: skip
    assert verdicts(case)["resolution 32"] == "imprecise"
    dominators = {
        item.setting.name: item.dominator.trial.setting.name
        for item in case.judged
        if item.dominator
    }
    assert dominators == {"best": "time 2 s", "resolution 128": "time 1 s"}
    assert case.default.setting == Setting(16)
    assert [item.verdict for item in case.ranked] == (
        ["front"] * 5 + ["dominated"] * 2 + ["imprecise"]
    )


def test_imprecise_settings_neither_dominate_nor_are_dominated():
    """The imprecise one is fast and recalls most, yet keeps none off the front."""
    (strict,) = cases_of(plain_trials())
    (lax,) = cases_of(plain_trials(), 0.9)
    assert verdicts(strict)["balanced"] == "front"
    assert verdicts(lax)["balanced"] == "dominated"
    assert [item.setting.name for item in lax.front] == ["draft", "resolution 32"]


def test_every_mesh_and_budget_has_a_front_of_its_own():
    trials = [*plain_trials(), *plain_trials("b.obj"), *plain_trials(budget=64, slower=0.01)]
    cases = cases_of(trials)
    assert [(case.mesh, case.budget) for case in cases] == [
        ("a.obj", 16), ("b.obj", 16), ("a.obj", 64),
    ]  # fmt: skip
    assert all(verdicts(case) == verdicts(cases[0]) for case in cases)


def test_failures_stand_apart():
    failed = Trial("a.obj", Setting(16, time=4.0), failure="out of memory")
    gone = Trial("gone.obj", None, failure="no such file")
    (case,) = cases_of([*plain_trials(), failed, gone])
    assert verdicts(case)["time 4 s"] == "failed"
    assert len(case.measured) == 8
    assert case.ranked[-1].verdict == "failed"
    (nothing,) = cases_of([failed])
    assert (nothing.front, nothing.measured, nothing.default) == ([], [], None)


@pytest.mark.parametrize("precision", [-0.1, 1.1, math.nan])
def test_precision_out_of_range(precision):
    with pytest.raises(OptionError):
        cases_of(plain_trials(), precision)


def test_gain_of_a_knob_is_that_of_its_next_step():
    advice = advise(cases_of(plain_trials()))
    time = knob(advice, "time")
    (step,) = time.slower
    assert step.item.setting.name == "time 1 s"
    assert (step.ratio, step.gain) == (2.0, pytest.approx(0.05))
    assert time.gain == pytest.approx(0.05)
    preset = knob(advice, "preset")
    assert preset.gain == pytest.approx(0.03 / 3.0)  # best: eight times as long
    assert preset.loss == pytest.approx(0.02)  # draft: half the time
    directions = knob(advice, "directions")
    assert (directions.slower, directions.faster) == ((), ())
    assert [step.gain for step in directions.level] == [0.0]
    # Resolution 32 is too imprecise to be a step; 128 takes three times as long.
    assert knob(advice, "resolution").gain == pytest.approx(0.02 / math.log2(3.0))
    assert [item.knob for item in advice.by_gain] == ["time", "resolution", "preset", "directions"]


def test_a_step_in_few_cases_does_not_come_first():
    slow = trial(Setting(16, directions=128), 2.0, 0.9)
    three = [plain_trials(mesh) for mesh in ("a.obj", "b.obj", "c.obj")]
    advice = advise(cases_of([*three[0], slow, *three[1], *three[2]]))
    assert knob(advice, "directions").gain == pytest.approx(0.4)
    assert advice.by_gain[0].knob == "time"
    assert advise(cases_of([*three[0], slow])).by_gain[0].knob == "directions"


def test_no_step_from_a_default_that_is_too_imprecise():
    trials = [replace(t, precision=0.5) if t.setting == Setting(16) else t for t in plain_trials()]
    advice = advise(cases_of(trials))
    assert all(not item.slower and not item.faster and not item.level for item in advice.knobs)
    assert words.advice_lines(advice)[0].startswith("For more recall: no step from the default")


def test_a_doubled_budget():
    more = [replace(t, recall=t.recall + 0.2) for t in plain_trials(budget=64)]
    advice = advise(cases_of([*plain_trials(), *more]))
    assert advice.triangles == (pytest.approx(0.1),)  # from 16 to 64 is two doublings


def test_what_never_pays():
    advice = advise(cases_of([t for at in range(10) for t in plain_trials(f"{at}.obj")]))
    pays = {pay.value: pay for pay in advice.pays}
    assert (pays["resolution 128"].paid, pays["resolution 128"].cases) == (0, 10)
    assert pays["resolution 128"].rivals == ("time 1 s",)
    assert (pays["draft"].paid, pays["draft"].cases) == (10, 10)
    assert (pays["resolution 32"].cases, pays["resolution 32"].imprecise) == (0, 10)
    assert words.never_lines(advice, 0.99) == [
        "Best never pays: in all 10 cases another setting is as fast and recalls as much, most "
        "often time 2 s.",
        "Resolution 32 is below 99 % precision in all 10 cases.",
        "Resolution 128 never pays: in all 10 cases another setting is as fast and recalls as "
        "much, most often time 1 s.",
    ]


@pytest.mark.parametrize("meshes", [1, 2, 9])
def test_few_cases_are_not_enough_to_say_that_something_never_pays(meshes):
    advice = advise(cases_of([t for at in range(meshes) for t in plain_trials(f"{at}.obj")]))
    lines = words.never_lines(advice, 0.99)
    assert not any("never pay" in line for line in lines)
    cases = f"{meshes} case{'s' * (meshes > 1)}"
    assert lines[-1] == (
        f"On no front so far: best and resolution 128. {cases} cannot tell whether they ever pay; "
        "that takes 10 cases or more (a case is a mesh at a budget)."
    )


def test_a_value_pays_when_one_of_its_combinations_does():
    slow = trial(Setting(16, resolution=128, time=2.0), 6.0, 0.7)
    advice = advise(cases_of([*plain_trials(), slow]))
    (pay,) = [pay for pay in advice.pays if pay.value == "resolution 128"]
    assert (pay.paid, pay.cases) == (1, 1)


def test_directions_are_many():
    slow = [trial(Setting(16, directions=96), 2.5, 0.5, mesh=f"{at}.obj") for at in range(10)]
    plain = [t for at in range(10) for t in plain_trials(f"{at}.obj")]
    advice = advise(cases_of([*plain, *slow]))
    assert any(
        line.startswith("96 directions never pay: in all 10 cases another setting")
        for line in words.never_lines(advice, 0.99)
    )


def test_advice_in_words():
    lines = words.advice_lines(advise(cases_of(plain_trials())))
    assert lines == [
        "For more recall, turn the time first: +5.0 points a doubling of time (median of 1 case; "
        "time 1 s takes 2 times as long).",
        "Then: resolution +1.3 points (1 case), preset +1.0 point (1 case).",
        "For less time, turn the preset first: -2.0 points a halving of time (median of 1 case; "
        "draft takes 0.5 times as long).",
    ]


def test_no_knob_gains():
    worse = [replace(t, recall=0.4) if t.seconds > 1.0 else t for t in plain_trials()]
    lines = words.advice_lines(advise(cases_of(worse)))
    assert lines[0].startswith("For more recall: no knob gains")


def test_standing_in_words():
    (case,) = cases_of(plain_trials())
    told = {item.setting.name: words.standing(item, 0.99) for item in case.judged}
    assert told["draft"] == "on the front"
    assert told["best"] == "dominated by time 2 s: 50 % less time, +7.0 points"
    assert told["resolution 32"] == "below 99 % precision: not compared"
    (_, failed) = cases_of([*plain_trials(), Trial("b", Setting(16), failure="no memory")])
    assert words.standing(failed.judged[0], 0.99) == "failed: no memory"


def test_warnings_are_told_once_with_the_settings_that_they_are_about():
    open_ = [
        replace(t, warnings=("it is open",)) if t.setting.resolution else t
        for t in [*plain_trials(), *plain_trials(budget=64)]
    ]
    dropped = [replace(t, warnings=("3 left out",)) for t in plain_trials("b.obj")]
    lines = study([*open_, *dropped, Trial("c.obj", None, failure="no such file")]).warnings
    assert lines == [
        "c.obj: no such file",
        "a.obj, resolution 32 and resolution 128: it is open",
        "b.obj: 3 left out",
    ]


@pytest.mark.parametrize(
    ("time", "text"),
    [(0.0123, "12 ms"), (0.0996, "0.10 s"), (1.234, "1.23 s"), (12.34, "12.3 s"), (120.4, "120 s")],
)
def test_seconds(time, text):
    assert short_seconds(time) == text
