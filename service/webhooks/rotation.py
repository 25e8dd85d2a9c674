"""The secrets that a tenant's webhooks are signed with just now: one, or two while they change."""

from __future__ import annotations

import time
from collections.abc import Callable

from service.jobs.deliveries import SecretAges
from service.webhooks.tenant_secrets import TenantSecrets


class CurrentSecrets:
    """A new secret is good at once; the one before for as long as was said when it was rotated.

    So receivers can be told the new one, one after the other, and none misses a word.
    """

    def __init__(
        self, secrets: TenantSecrets, ages: SecretAges, clock: Callable[[], float] = time.time
    ) -> None:
        self._secrets, self._ages, self._clock = secrets, ages, clock

    def of(self, tenant: str) -> tuple[str, ...]:
        """The newest first."""
        age = self._ages.age(tenant)
        newest = self._secrets.of(tenant, age.generation)
        if age.generation == 0 or self._clock() >= age.overlap_ends:
            return (newest,)
        return (newest, self._secrets.of(tenant, age.generation - 1))
