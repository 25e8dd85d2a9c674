"""The words of a picture."""

from __future__ import annotations

from service.dashboard.jobs.best_so_far import best_words
from service.jobs.progress import JobProgress


def test_they_say_when_and_how_good() -> None:
    progress = JobProgress("refine", 0.5, 0.7129, seconds=3.21)
    assert best_words(progress) == (
        "best so far after 3.21 s: hides 71.2 % of what the original hides"
    )
