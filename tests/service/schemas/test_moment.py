from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from service.schemas.job import Moment, moment

MOMENT = TypeAdapter(Moment)


@given(st.floats(0.0, 4e9))
def test_what_is_shown_is_never_later_and_hardly_earlier(seconds):
    shown = MOMENT.validate_json(MOMENT.dump_json(moment(seconds))).timestamp()
    assert seconds - 2e-6 <= shown <= seconds


def test_times_are_written_in_utc():
    assert MOMENT.dump_json(moment(1.5)) == b'"1970-01-01T00:00:01.500000Z"'


@pytest.mark.parametrize("text", ["0.5", "2024-01-01", "2024-01-01T00:00:00", "yesterday", ""])
def test_a_time_has_to_be_written_out_with_its_offset(text):
    with pytest.raises(ValidationError):
        MOMENT.validate_python(text)
