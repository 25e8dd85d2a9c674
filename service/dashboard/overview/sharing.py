"""One reading of all assets for all pages that show the same."""

from __future__ import annotations

import threading
from datetime import datetime
from weakref import WeakKeyDictionary

from service.dashboard.overview.asset_lines import Overview, read_overview
from service.jobs.asset import AssetStore

_MOST_KEPT = 4
"""Readings of a store; each of 5,000 assets takes 10 MiB."""

_kept: WeakKeyDictionary[AssetStore, dict[tuple[str, datetime], Overview]] = WeakKeyDictionary()
_lock = threading.Lock()


def shared_overview(assets: AssetStore, tenant: str, since: datetime) -> Overview:
    """The very same value until something has changed.  Waits for the database."""
    with _lock:  # pages that look at the same time wait for one of them to read
        kept = _kept.setdefault(assets, {})
        overview = kept.pop((tenant, since), None)
        if overview is None or overview.stamp != assets.stamp(tenant):
            overview = read_overview(assets, tenant, since)
        kept[tenant, since] = overview
        if len(kept) > _MOST_KEPT:
            del kept[next(iter(kept))]
        return overview
