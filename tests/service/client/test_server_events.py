"""Server-sent events, cut anywhere."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from service.client.wire import ServerEvent, server_events

STREAM = (
    b": hello\n\nevent: state\ndata: {1}\r\n\r\ndata:a\rdata: b\r\rid: 7\nevent: x\n\n"
    b"event: progress\ndata: caf\xc3\xa9 \xe2\x80\xa8 sep\n\nevent: lost\ndata: half\n"
)
EVENTS = [
    ServerEvent("state", "{1}"),
    ServerEvent("message", "a\nb"),
    ServerEvent("progress", "café \u2028 sep"),
]


@given(st.lists(st.integers(0, len(STREAM))))
def test_cuts_of_the_stream_change_nothing(cuts):
    places = [0, *sorted(cuts), len(STREAM)]
    chunks = [STREAM[a:b] for a, b in pairwise(places)]
    assert list(server_events(chunks)) == EVENTS
