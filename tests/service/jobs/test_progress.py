"""The board keeps what was told last, and with it the last picture."""

from __future__ import annotations

from service.jobs.progress import LARGEST_PICTURE, JobProgress, ProgressBoard, Snapshot


def told(*pictures: Snapshot | None) -> list[Snapshot | None]:
    """What the board has after each."""
    board, seen = ProgressBoard(), []
    for number, picture in enumerate(pictures):
        board.tell("a", JobProgress("refine", 0.1 * number, picture=picture))
        latest = board.latest("a")
        assert latest is not None
        assert latest.fraction == 0.1 * number
        seen.append(latest.picture)
    return seen


def test_a_picture_stays_until_the_next():
    first, second = Snapshot(1, b"first"), Snapshot(2, b"second")
    assert told(None, first, None, second, None) == [None, first, first, second, second]


def test_a_picture_that_is_too_large_is_dropped():
    first, large = Snapshot(1, b"x" * LARGEST_PICTURE), Snapshot(2, b"x" * (LARGEST_PICTURE + 1))
    assert told(large, first, large) == [None, first, first]


def test_the_next_attempt_begins_without():
    board = ProgressBoard()
    board.tell("a", JobProgress("refine", 0.5, picture=Snapshot(1, b"x")))
    board.end("a")
    board.tell("a", JobProgress("load", 0.0))
    assert board.latest("a") == JobProgress("load", 0.0)
