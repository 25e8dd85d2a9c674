"""What becomes of a word: an occluder in the pipeline's folder."""

from __future__ import annotations

import logging
import os
import subprocess
import threading
from collections.abc import Mapping, Sequence
from datetime import datetime
from http import HTTPStatus
from pathlib import Path, PurePosixPath
from typing import Any

from examples.webhook_receiver.ledger import Ledger
from examples.webhook_receiver.server import TryLaterError
from service.client import Client, ClientError

_log = logging.getLogger("webhook_receiver")


class UnsafeNameError(Exception):
    """An asset whose file would lie outside of the folder."""


class Writer:
    """Writes the occluders of words, one at a time, each once.

    ``client``  of the service; its address is known here and never taken from a word.
    ``then``    a command, run in the folder with the path of what was written; empty for none.
    """

    def __init__(
        self, client: Client, folder: Path, ledger: Ledger, then: Sequence[str] = ()
    ) -> None:
        self._client, self._folder = client, folder.resolve()
        self._ledger, self._then = ledger, then
        self._one_at_a_time = threading.Lock()

    def write(self, word: Mapping[str, Any]) -> None:
        """Raises :class:`TryLaterError`.

        The id is the body's: the header of that name is not signed.
        """
        delivery = word["id"]
        with self._one_at_a_time:
            if self._ledger.has(delivery):
                _log.info("%s was heard before", delivery)
                return
            job = word["job"]
            if (job["kind"], job["state"]) != ("occluder", "succeeded"):
                _log.info("%s: the %s of %s %s", delivery, job["kind"], job["name"], job["state"])
                self._ledger.note(delivery)
                return
            self._write_job(delivery, job)

    def _write_job(self, delivery: str, job: Mapping[str, Any]) -> None:
        created = datetime.fromisoformat(job["created"]).timestamp()
        try:
            file = _file_of(job)
            if self._ledger.newest(file) > created:
                _log.info("%s is of a newer job already", file)
            else:
                self._fetch(job["id"], file)
        except UnsafeNameError as error:
            _log.error("%s: %s", delivery, error)
            self._ledger.note(delivery)
            return
        self._ledger.note(delivery, file, created)

    def _fetch(self, job_id: str, file: str) -> None:
        target = self._folder / file
        try:
            if not target.resolve().is_relative_to(self._folder):
                raise UnsafeNameError(f"'{file}' leads out of the folder by a link")
            target.parent.mkdir(parents=True, exist_ok=True)
            self._client.download(job_id, target)
            if self._then:
                subprocess.run(
                    [*self._then, os.fspath(target)], cwd=self._folder, check=True,
                    stdin=subprocess.DEVNULL,
                )  # fmt: skip
        except ClientError as error:
            if error.problem.status == HTTPStatus.NOT_FOUND:
                _log.error("job %s is there no more", job_id)
                return
            raise TryLaterError(str(error)) from None
        except (OSError, subprocess.CalledProcessError) as error:
            raise TryLaterError(f"{file}: {error}") from None
        _log.info("%s written", target)


def _file_of(job: Mapping[str, Any]) -> str:
    """``props/castle_occluder.glb`` of the asset ``props/castle``; else by the mesh's name."""
    name = job["asset"]["name"] if job["asset"] else PurePosixPath(job["name"]).stem
    parts = name.split("/")
    if not all(map(_is_plain, parts)):
        raise UnsafeNameError(f"{name!r} is no name for a file; rename the asset")
    return f"{name}_occluder.glb"


def _is_plain(part: str) -> bool:
    return part not in ("", ".", "..") and part.isprintable() and not set(part) & set("\\:")
