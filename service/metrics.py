"""What is counted as requests and jobs end, and what is read when Prometheus asks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.exposition import generate_latest
from prometheus_client.metrics_core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector

from service.jobs.asset import Asset, AssetStore
from service.jobs.deliveries import WebhookOutcome
from service.jobs.job import JobState
from service.jobs.stores import BlobStore, JobStore, Scrub
from service.jobs.tallies import BOUNDS, Counted, Labels, Tallies, Tally

_LATENCIES = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_PAGE = 500

OTHER = "other"
"""The route of requests that none of ours is for, and the method of those that no route has."""

Readings = Mapping[str, tuple[str, Callable[[], float | None]]]
"""Gauges by name: what each says, and how it is read; None where it cannot be just now."""


class Metrics:
    """Counters of one application, beginning at 0 with it, and what the stores count for all.

    Of jobs all servers that share a database tell the same.  Safe from any thread.
    """

    def __init__(
        self,
        jobs: JobStore,
        assets: AssetStore,
        blobs: BlobStore,
        scrub: Scrub,
        tallies: Tallies,
        most_assets: int,
    ) -> None:
        """``most_assets``  that have series of their own."""
        self._assets, self._most_assets = assets, most_assets
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        self._registry.register(_Queue(jobs))
        self._registry.register(_Ended(tallies))
        self._registry.register(_Blobs(blobs, scrub))
        self._latency = Histogram(
            "occluder_http_request_seconds",
            "Seconds until an answer began, by route; without those that were to wait for a job.",
            ["method", "route"], buckets=_LATENCIES, registry=self._registry,
        )  # fmt: skip
        self._responses = Counter(
            "occluder_http_responses", "Answers, by route and status.",
            ["method", "route", "status"], registry=self._registry,
        )  # fmt: skip
        self._webhooks = Counter(
            "occluder_webhook_attempts",
            "Tries to deliver webhooks: heard, failed (and tried again), or given up.",
            ["outcome"], registry=self._registry,
        )  # fmt: skip
        for outcome in WebhookOutcome:
            self._webhooks.labels(outcome)  # so that the first one is an increase
        self._hangups = Counter(
            "occluder_connections_ended", "Connections that the server ended, by reason.",
            ["reason"], registry=self._registry,
        )  # fmt: skip

    def count_answer(
        self, method: str, route: str | None, status: int, seconds: float, *, waited: bool
    ) -> None:
        """Count an answer that began after some seconds.

        ``route``   its template, which has no ids in it; None where no route was for it.
        ``waited``  whether it was to wait, so that the time says nothing of the service.
        """
        named = method if method in _METHODS else OTHER, route or OTHER
        self._responses.labels(*named, status).inc()
        if not waited:
            self._latency.labels(*named).observe(seconds)

    def count_webhook(self, outcome: WebhookOutcome) -> None:
        """Count a try to deliver a webhook."""
        self._webhooks.labels(outcome).inc()

    def watch(self, readings: Readings) -> None:
        """Read these as well whenever somebody asks."""
        self._registry.register(_Readings(readings))

    def count_hangup(self, reason: str) -> None:
        """Count a connection that went beyond its limits."""
        self._hangups.labels(reason).inc()

    def text(self, tenant: str | None) -> bytes:
        """All metrics as Prometheus reads them, with a tenant's assets; None for everyone's."""
        assets = CollectorRegistry()
        assets.register(_Assets(self._assets, tenant, self._most_assets))
        return generate_latest(self._registry) + generate_latest(assets)


class _Readings(Collector):
    """Gauges that are read when somebody asks."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings

    def describe(self) -> Iterable[Metric]:
        """As for the queue."""
        return ()

    def collect(self) -> Iterator[Metric]:
        for name, (what, read) in self._readings.items():
            try:
                value = read()
            except OSError:
                value = None  # the others are told nevertheless
            if value is not None:
                yield GaugeMetricFamily(name, what, value=value)


class _Queue(Collector):
    """Jobs by state, as they are when asked."""

    def __init__(self, jobs: JobStore) -> None:
        self._jobs = jobs

    def describe(self) -> Iterable[Metric]:
        """Nothing: so that the registry does not collect to learn the names."""
        return ()

    def collect(self) -> Iterator[Metric]:
        counts = self._jobs.counts()
        jobs = GaugeMetricFamily("occluder_jobs", "Jobs that are stored.", labels=["state"])
        for state in JobState:
            jobs.add_metric([state], counts.get(state, 0))
        yield jobs
        yield GaugeMetricFamily(
            "occluder_queue_depth", "Jobs that wait.", value=counts.get(JobState.QUEUED, 0)
        )
        oldest = self._jobs.oldest_queued()
        yield GaugeMetricFamily(
            "occluder_queue_oldest_seconds",
            "Since the oldest job that waits was submitted; 0 where none does.",
            value=0.0 if oldest is None else max(time.time() - oldest, 0.0),
        )


class _Ended(Collector):
    """Jobs that have ended, and how long they took, over all servers."""

    def __init__(self, tallies: Tallies) -> None:
        self._tallies = tallies

    def describe(self) -> Iterable[Metric]:
        """As for the queue."""
        return ()

    def collect(self) -> Iterator[Metric]:
        totals = sorted(self._tallies.totals().items())
        ended = CounterMetricFamily(
            "occluder_jobs_ended", "Jobs that ended, by kind and state.", labels=["kind", "state"]
        )
        failures = CounterMetricFamily(
            "occluder_job_failures", "Jobs that failed, by what they failed of.",
            labels=["failure"],
        )  # fmt: skip
        for (counted, *labels), tally in totals:
            if counted == Counted.ENDED:
                ended.add_metric(labels, tally.count)
            elif counted == Counted.FAILED:
                failures.add_metric(labels, tally.count)
        yield ended
        yield failures
        yield self._seconds(totals)

    def _seconds(self, totals: Iterable[tuple[Labels, Tally]]) -> Metric:
        by_stage: dict[tuple[str, str], dict[str, Tally]] = {}
        for (counted, *labels), tally in totals:
            if counted == Counted.SECONDS:
                kind, stage, bound = labels
                by_stage.setdefault((kind, stage), {})[bound] = tally
        seconds = HistogramMetricFamily(
            "occluder_job_seconds", "Seconds of jobs that succeeded, by kind and stage.",
            labels=["kind", "stage"],
        )  # fmt: skip
        for names, tallies in by_stage.items():
            count, buckets = 0, []
            for bound in (*map(str, BOUNDS), "inf"):
                count += tallies[bound].count if bound in tallies else 0
                buckets.append((bound.replace("inf", "+Inf"), float(count)))
            total = sum(tally.total for tally in tallies.values())
            seconds.add_metric(list(names), buckets, total)
        return seconds


class _Blobs(Collector):
    """What is known of damage on the disk."""

    def __init__(self, blobs: BlobStore, scrub: Scrub) -> None:
        self._blobs, self._scrub = blobs, scrub

    def describe(self) -> Iterable[Metric]:
        """As for the queue."""
        return ()

    def collect(self) -> Iterator[Metric]:
        yield CounterMetricFamily(
            "occluder_broken_reads",
            "Reads, for downloads and jobs, that found a damaged blob.",
            value=self._blobs.broken_reads,
        )
        yield GaugeMetricFamily(
            "occluder_corrupt_blobs",
            "Blobs that are damaged and that nobody has sent or made again yet.",
            value=self._blobs.corrupt,
        )
        found = self._scrub.figures()
        yield CounterMetricFamily(
            "occluder_scrubbed_blobs", "Blobs that were read anew.", value=found.checked
        )
        yield CounterMetricFamily(
            "occluder_scrubbed_bytes", "Bytes that were read anew.", value=found.size
        )
        yield CounterMetricFamily(
            "occluder_scrub_damage", "Blobs that reading anew found damaged.", value=found.damaged
        )
        yield GaugeMetricFamily(
            "occluder_lost_blobs",
            "Blobs that jobs name and that are gone, when it was last looked for them.",
            value=found.lost,
        )
        if found.oldest_age is not None:
            yield GaugeMetricFamily(
                "occluder_oldest_blob_check_seconds",
                "Age of the oldest check of a stored blob.",
                value=found.oldest_age,
            )


class _Assets(Collector):
    """How good the latest run of each asset is, of the first so many by name."""

    def __init__(self, assets: AssetStore, tenant: str | None, most: int) -> None:
        self._assets, self._tenant, self._most = assets, tenant, most

    def describe(self) -> Iterable[Metric]:
        """As for the queue."""
        return ()

    def collect(self) -> Iterator[Metric]:
        labels = ["tenant", "asset"]
        precision = GaugeMetricFamily(
            "occluder_asset_precision", "Precision of the latest run, 0 to 1.", labels=labels
        )
        recall = GaugeMetricFamily(
            "occluder_asset_recall", "Recall of the latest run, 0 to 1.", labels=labels
        )
        overhang = GaugeMetricFamily(
            "occluder_asset_overhang",
            "Covered beside the mesh by the latest run, as a share of its silhouette.",
            labels=labels,
        )
        verdict = GaugeMetricFamily(
            "occluder_asset_verdict", "1 for the word on the latest run: good, weak or unusable.",
            labels=[*labels, "verdict"],
        )  # fmt: skip
        holds = GaugeMetricFamily(
            "occluder_asset_holds", "1 where the latest run meets the thresholds, else 0.",
            labels=labels,
        )  # fmt: skip
        for asset in islice(self._all(), self._most):
            summary = asset.latest.summary if asset.latest else None
            if summary is None:
                continue
            names = [asset.tenant, asset.name]
            held = asset.demanded.held_by(summary)
            for gauge, value in (
                (precision, summary.precision), (recall, summary.recall),
                (overhang, summary.overhang), (holds, held),
            ):  # fmt: skip
                if value is not None:
                    gauge.add_metric(names, float(value))
            if summary.verdict is not None:
                verdict.add_metric([*names, summary.verdict], 1.0)
        yield from (precision, recall, overhang, verdict, holds)

    def _all(self) -> Iterator[Asset]:
        after: str | None = None
        while True:
            page = self._assets.assets(self._tenant, after=after, limit=_PAGE)
            yield from page.assets
            after = page.cursor
            if after is None:
                return
