"""What changed from one run to another, as plain values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from service.dashboard.asset.details import RunDetail, Stores, read_run
from service.dashboard.jobs.words import option_words
from service.dashboard.views import View
from service.dashboard.wording import length, overhang, percent, points, seconds, whole
from service.errors import NotFoundError
from service.jobs.job import JobFile, Summary, inputs_by_part

_ALIKE = 1e-9
_LISTED = 8


@dataclass(frozen=True)
class NumberChange:
    """One number of both runs, in words.

    ``better``  whether the change is for the better; None where it is neither, or nothing changed.
    """

    name: str
    a: str
    b: str
    change: str
    better: bool | None


@dataclass(frozen=True)
class ViewChange:
    """What became of one direction from one run to the other."""

    a: View
    b: View

    @property
    def rise(self) -> float:
        """How much more is recalled in b than in a."""
        return self.b.recall - self.a.recall


@dataclass(frozen=True)
class ComparedRuns:
    """Two runs and how they differ.

    ``options``  by name, those that differ, as they are in a and in b.
    ``files``    likewise, what was sent, by the part that it came as.
    ``views``    in which recall changed most; empty where they were looked at along other lines.
    """

    a: RunDetail
    b: RunDetail
    numbers: tuple[NumberChange, ...]
    options: tuple[tuple[str, str, str], ...]
    files: tuple[tuple[str, str, str], ...]
    views: tuple[ViewChange, ...]


def read_comparison(stores: Stores, tenant: str, a: str, b: str) -> ComparedRuns:
    """Waits for database and disk.

    Raises :class:`~service.errors.NotFoundError`, also for a job that has not succeeded.
    """
    runs = [read_run(stores, tenant, job_id) for job_id in (a, b)]
    for run in runs:
        if run.job.summary is None:
            raise NotFoundError(f"job {run.job.id} has no result to compare")
    first, second = runs
    return ComparedRuns(
        first,
        second,
        tuple(_numbers(first.job.summary, second.job.summary)),
        tuple(_options(first.job.options, second.job.options)),
        tuple(_files(stores.jobs.files(a), stores.jobs.files(b))),
        tuple(largest_changes(first.views, second.views)),
    )


def largest_changes(a: Sequence[View], b: Sequence[View]) -> list[ViewChange]:
    """The largest falls of recall first, then what else changed."""
    if not _same_lines(a, b):
        return []
    pairs = [ViewChange(*pair) for pair in zip(a, b, strict=True)]
    changed = [pair for pair in pairs if abs(pair.rise) > _ALIKE]
    largest = sorted(changed, key=lambda pair: -abs(pair.rise))[:_LISTED]
    return sorted(largest, key=lambda pair: pair.rise)


def _same_lines(a: Sequence[View], b: Sequence[View]) -> bool:
    return len(a) == len(b) and all(
        abs(x - y) < _ALIKE
        for one, other in zip(a, b, strict=True)
        for x, y in zip(one.direction, other.direction, strict=True)
    )


def _numbers(a: Summary | None, b: Summary | None) -> list[NumberChange]:
    assert a is not None, "jobs that have succeeded have a summary"
    assert b is not None, "jobs that have succeeded have a summary"
    return [
        _change("Recall", a.recall, b.recall, percent, more_is_better=True, apart=points),
        _change("Precision", a.precision, b.precision, percent, more_is_better=True, apart=points),
        _change("Worst view's recall", a.worst_recall, b.worst_recall, percent,
                more_is_better=True, apart=points),
        _change("Overhang", a.overhang, b.overhang, overhang, more_is_better=False,
                apart=points),
        _change("Triangles", a.triangles, b.triangles, _whole, more_is_better=False),
        _change("Error bound", a.error_bound, b.error_bound, length, more_is_better=False),
        _change("Run time", a.seconds, b.seconds, seconds, more_is_better=False),
        _change("Levels", a.levels, b.levels, _whole),
        _change("Triangles of the original", a.input_triangles, b.input_triangles, _whole),
    ]  # fmt: skip


def _change(
    name: str,
    a: float | None,
    b: float | None,
    words: Callable[[float], str],
    *,
    more_is_better: bool | None = None,
    apart: Callable[[float], str] | None = None,
) -> NumberChange:
    if a is None or b is None:
        first, second = ("-" if one is None else words(one) for one in (a, b))
        return NumberChange(name, first, second, "", None)
    rise = b - a
    if abs(rise) <= _ALIKE:
        return NumberChange(name, words(a), words(b), "", None)
    sign = "+" if rise > 0.0 else "-"
    better = None if more_is_better is None else (rise > 0.0) == more_is_better
    return NumberChange(name, words(a), words(b), f"{sign}{(apart or words)(abs(rise))}", better)


def _whole(value: float) -> str:
    return whole(int(value))


def _options(a: Any, b: Any) -> list[tuple[str, str, str]]:
    return [
        (name, option_words(a.get(name)), option_words(b.get(name)))
        for name in sorted({*a, *b})
        if a.get(name) != b.get(name)
    ]


def _files(a: Iterable[JobFile], b: Iterable[JobFile]) -> Iterator[tuple[str, str, str]]:
    first, second = inputs_by_part(a), inputs_by_part(b)
    for part in sorted({*first, *second}):
        one, other = first.get(part), second.get(part)
        if one is None or other is None or one.blob.digest != other.blob.digest:
            yield part, _file_words(one), _file_words(other)


def _file_words(file: JobFile | None) -> str:
    """Runs of an asset often send files of one name, so the begin of the hash tells them apart."""
    if file is None:
        return "-"
    return f"{file.label or file.name} ({file.blob.digest[:8]})"
