"""What can be asked for, and what is refused before there is a mesh."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier import EvaluateOptions, OptionError, SimplifyOptions
from simplifier.options.simplify import LodOptions


def test_defaults_are_a_single_occluder():
    assert SimplifyOptions.of({}) == SimplifyOptions()
    assert SimplifyOptions().levels is None
    assert EvaluateOptions.of({}) == EvaluateOptions()


def test_lists_become_tuples():
    options = SimplifyOptions.of({"error_bounds": [2.0, 1], "fov": 45})
    assert options.error_bounds == (2.0, 1)
    assert options.levels == LodOptions(None, (1, 2.0), fov=45)


WRONG = [
    ({"speed": 9}, "speed: there is no such option; choose from budget"),
    ({"budget": "64"}, "budget: '64' is not a whole number"),
    ({"budget": 64.0}, "budget: 64.0 is not a whole number"),
    ({"budget": True}, "budget: True is not a whole number; choose 1 to 100,000"),
    ({"budget": None}, "budget: None is not a whole number"),
    ({"ground": "yes"}, "ground: 'yes' is neither true nor false; give true or false"),
    ({"up": ["y"]}, "up: .* is not known; choose one of x, y, z"),
    ({"error_bounds": 1.0}, "error bounds: 1.0 is not a list of lengths"),
    ({"error_bounds": ["1"]}, "error bounds: '1' is out of range"),
    ({"error_bounds": []}, "error bounds: 0 lengths are given"),
    ({"error_bounds": [1.0, 1.0]}, "error bounds: 1.0 is given twice"),
    ({"min_precision": 1.5}, "min precision: 1.5 is out of range"),
    ({"lods": 2, "error_bounds": [1.0]}, "lods: give either"),
    ({"error_bounds": [1.0], "resolution": 9}, "error bounds: cannot be given together"),
    ({"fov": 60.0}, "fov: only levels of detail have one"),
    ({"lods": 2, "shrink": 0.5}, "lods: .* wholly inside"),
    ({"resolution": 9, "error_bound": 1.0, "lods": 2}, "error bound: cannot be given together"),
    ({"error_share": 0.5, "error_bound": 1.0}, "error share: cannot be given together"),
    ({"error_share": 0.5, "error_bounds": (1.0,)}, "error bounds: cannot be given together"),
    ({"moves": 9, "time_limit": 1.0}, "time limit: cannot be given together"),
]


@pytest.mark.parametrize(("chosen", "words"), WRONG)
def test_what_is_refused_without_a_mesh(chosen, words):
    with pytest.raises(OptionError, match=f"^{words}"):
        SimplifyOptions.of(chosen)


def test_evaluating_has_fewer_options():
    with pytest.raises(OptionError, match=r"^budget: there is no such option"):
        EvaluateOptions.of({"budget": 9})
    with pytest.raises(OptionError, match=r"^image: 7 is out of range"):
        EvaluateOptions.of({"image": 7})


anything = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=9),
    st.lists(st.floats(), max_size=3), st.dictionaries(st.text(max_size=2), st.none(), max_size=1),
)  # fmt: skip


@given(st.dictionaries(st.sampled_from([one.name for one in SimplifyOptions.fields()]), anything))
def test_any_json_is_taken_or_refused(chosen):
    try:
        options = SimplifyOptions.of(chosen)
    except OptionError:
        return
    assert SimplifyOptions.of(json.loads(json.dumps(asdict(options)))) == options


def test_lists_are_tuples_and_numpy_s_truth_is_python_s():
    options = SimplifyOptions(error_bounds=[0.1, np.float64(0.2)], ground=np.True_)
    assert options == SimplifyOptions(error_bounds=(0.1, 0.2), ground=True)
    assert hash(options) == hash(SimplifyOptions(error_bounds=(0.1, 0.2), ground=True))
    assert type(options.ground) is bool
