"""Traces by OpenTelemetry: a request, the job that it asked for, and the webhook that tells of it.

They are sent where the ``OTEL_*`` variables say, by the rules of its SDK
(https://opentelemetry.io/docs/specs/otel/configuration/sdk-environment-variables/).  Without these
variables nothing of it is loaded.  A job carries the W3C ``traceparent`` of its request, so that
whichever server does it, and whichever tells of it, adds to the same trace.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from typing import Any, Protocol

_log = logging.getLogger(__name__)

HEADER = "traceparent"


class SpanKind(Enum):
    """What a span is of."""

    SERVER = "SERVER"
    """A request that is answered."""
    CONSUMER = "CONSUMER"
    """A job that was put down before."""
    CLIENT = "CLIENT"
    """A request to another."""


class Span(Protocol):
    """A part of a trace while it goes on."""

    def set_attribute(self, key: str, value: Any) -> None: ...

    def update_name(self, name: str) -> None: ...


class _NoSpan:
    """Nobody traces."""

    def set_attribute(self, key: str, value: Any) -> None: ...

    def update_name(self, name: str) -> None: ...


_tracer: Any = None


@contextmanager
def tracing() -> Iterator[None]:
    """A block whose spans are sent, if the variables say where; what is left is sent at its end."""
    global _tracer
    if not _wanted():
        yield
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ModuleNotFoundError as error:
        _log.warning(
            "OTEL_* says where traces go, and '%s' is not installed; "
            "run: pip install 'planar-occluder[cluster]'",
            error.name,
        )
        yield
        return
    named = {} if "OTEL_SERVICE_NAME" in os.environ else {"service.name": "occluder"}
    provider = TracerProvider(resource=Resource.create(named))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    _tracer = provider.get_tracer("occluder")
    try:
        yield
    finally:
        _tracer = None
        provider.shutdown()


def _wanted() -> bool:
    off = os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true"
    places = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
    return not off and any(os.environ.get(name) for name in places)


@contextmanager
def span(
    name: str, kind: SpanKind, parent: str | None, attributes: Mapping[str, Any] | None = None
) -> Iterator[Span]:
    """A block that is a part of a trace: of that of a ``parent``, or else of a new one."""
    if _tracer is None:
        yield _NoSpan()
        return
    from opentelemetry import trace
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    carried = TraceContextTextMapPropagator().extract({HEADER: parent} if parent else {})
    with _tracer.start_as_current_span(
        name, carried, trace.SpanKind[kind.value], dict(attributes or {})
    ) as begun:
        yield begun


def traceparent() -> str | None:
    """Of the span that this is done in; None where nobody traces."""
    if _tracer is None:
        return None
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    carrier: dict[str, str] = {}
    TraceContextTextMapPropagator().inject(carrier)
    return carrier.get(HEADER)
