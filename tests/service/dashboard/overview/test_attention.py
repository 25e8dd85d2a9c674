"""What needs attention first."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

from service.dashboard.overview.asset_lines import Overview, falls_since
from service.dashboard.overview.attention import Reason, gaps, matters
from service.jobs.asset import FailedUpload, Thresholds
from service.jobs.job import Failure
from tests.service.dashboard.overview.test_asset_lines import RUN, line

FAILURE = Failure("unreadable-mesh", "it ends too soon", "export it again")


def test_what_failed_comes_before_what_is_below_and_that_before_what_fell() -> None:
    lines = (
        line("fell", replace(RUN, job_id="new", recall=0.7)),
        line("far", replace(RUN, job_id="new", recall=0.3), Thresholds(min_recall=0.9)),
        line("near", RUN, Thresholds(min_recall=0.85)),
        line("failed", None),
        line("fine"),
    )
    failed = FailedUpload("job9", "gate.glb", "id of failed", "failed", 5.0, FAILURE)
    worse = falls_since(lines, {"id of fell": RUN, "id of far": RUN})
    found = matters(Overview(lines, worse, datetime(2024, 5, 1, tzinfo=UTC), None, (failed,)))
    assert [(one.name, one.reason) for one in found] == [
        ("failed", Reason.FAILED), ("far", Reason.MISSED), ("near", Reason.MISSED),
        ("fell", Reason.WORSE),
    ]  # fmt: skip
    assert found[0].words == (
        "The upload of gate.glb failed. The mesh cannot be read. It ends too soon."
    )
    assert found[0].link == "/jobs/job9"
    assert found[1].words == "Recall is 30.00 %, 60.00 points below 90 %."
    assert found[3].words == "Recall fell from 80.00 % to 70.00 %."


def test_an_upload_of_no_asset_is_called_by_its_file() -> None:
    failed = FailedUpload("job9", "gate.glb", None, None, 5.0, FAILURE)
    (found,) = matters(Overview((), (), datetime(2024, 5, 1, tzinfo=UTC), None, (failed,)))
    assert (found.name, found.address) == ("gate.glb", "/jobs/job9")


def test_every_gap_is_told_with_its_size() -> None:
    run = replace(RUN, precision=0.98, recall=None, overhang=0.02)
    found = gaps(Thresholds(0.99, 0.5, 0.01), run)
    assert [words for _, words in found] == [
        "recall was not measured; at least 50 % is set",
        "precision is 98.00 %, 1.00 points below 99 %",
        "overhang is 2.00 %, 1.00 points above 1 %",
    ]
    assert gaps(Thresholds(0.98, None, 0.02), run) == []
