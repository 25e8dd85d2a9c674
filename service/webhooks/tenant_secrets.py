"""What each tenant's webhooks are signed with, derived from one secret in the data folder.

So a tenant's secret can be shown again at any time, and none is in the database or its backups.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
from base64 import urlsafe_b64encode
from contextlib import suppress
from pathlib import Path

from service.errors import SettingsError
from service.settings import Settings

_FILE = "webhook_secret"
_BYTES = 32
_PREFIX = "whsec_"


class TenantSecrets:
    """Secrets by tenant, from a master secret."""

    def __init__(self, master: bytes) -> None:
        self._master = master

    @classmethod
    def named_by(cls, settings: Settings) -> TenantSecrets:
        """Those of the file that the settings name, else of the data folder.

        Raises as :meth:`open` and :meth:`read` do.
        """
        file = settings.secret_file
        return cls.open(settings.data) if file is None else cls.read(file)

    @classmethod
    def open(cls, folder: Path) -> TenantSecrets:
        """Read the master secret of a data folder, or make it; several processes may do so at once.

        Raises :class:`~service.errors.SettingsError` where it cannot be read or made, or others
        than its owner may read it.
        """
        path = folder / _FILE
        try:
            with suppress(FileExistsError):
                _make(path)
        except OSError as error:
            raise SettingsError(
                f"{path}: the webhooks' secret cannot be made ({error.strerror}); "
                "check the rights of the data folder"
            ) from None
        return cls.read(path)

    @classmethod
    def read(cls, path: Path) -> TenantSecrets:
        """Raises :class:`~service.errors.SettingsError` where the file cannot be read, is no
        secret, or others than its owner may read it."""
        try:
            mode, master = path.stat().st_mode, path.read_bytes()
        except OSError as error:
            raise SettingsError(
                f"{path}: the webhooks' secret cannot be read ({error.strerror}); "
                "check the file and its rights"
            ) from None
        if os.name == "posix" and mode & 0o077:
            raise SettingsError(f"{path}: others may read the webhooks' secret; chmod 600 it")
        if len(master) != _BYTES:
            raise SettingsError(
                f"{path}: the webhooks' secret is damaged: it has {len(master)} bytes, and not "
                f"{_BYTES}; put it back from a backup, or delete it and give every receiver its "
                "new one ('occluder keys secret')"
            )
        return cls(master)

    @property
    def fingerprint(self) -> str:
        """Equal for equal secrets; nothing of them can be told from it."""
        return self.signing_key("fingerprint").hex()

    def signing_key(self, purpose: str) -> bytes:
        """32 bytes for what this service signs for itself, others for each purpose."""
        return hmac.new(self._master, f"key for {purpose}".encode(), hashlib.sha256).digest()

    def of(self, tenant: str, generation: int = 0) -> str:
        """The secret that a tenant's receivers verify with, after so many rotations."""
        # No tenant has a space in its name, so that none has the secret of another's generation.
        purpose = f"webhooks of {tenant}" + (f" {generation}" if generation else "")
        derived = hmac.new(self._master, purpose.encode(), hashlib.sha256).digest()
        return _PREFIX + urlsafe_b64encode(derived).decode().rstrip("=")


def _make(path: Path) -> None:
    """Whole or not at all; raises FileExistsError where there is one, which stays."""
    if path.exists():
        raise FileExistsError
    draft = path.with_name(f"{_FILE}.{secrets.token_hex(8)}.tmp")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(secrets.token_bytes(_BYTES))
            file.flush()
            os.fsync(file.fileno())
        os.link(draft, path)  # unlike a rename, it does not replace what another process made
    finally:
        draft.unlink(missing_ok=True)
