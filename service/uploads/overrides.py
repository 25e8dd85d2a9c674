"""The part of a form that may bring overrides of a mesh."""

from __future__ import annotations

from service.errors import InvalidOverridesError
from service.uploads.receiving import Wanted

OVERRIDES = Wanted(
    "overrides",
    (".toml",),
    "Parts drawn by hand, regions to leave open and what to ignore of the mesh, as TOML; at most "
    "1 MiB.",
    needed=False,
    largest=1 << 20,  # a thousand times what people write
    fault=InvalidOverridesError,
)
