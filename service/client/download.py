"""A file from the server: whole and as announced, or not at all."""

from __future__ import annotations

import hashlib
import secrets
from contextlib import closing
from pathlib import Path

import httpx

from service.client.errors import spoiled
from service.client.sending import Build, Sender

_TRIES = 4


def download(sender: Sender, build: Build, target: Path) -> None:
    """Write what is answered beside the target and rename, once its SHA-256 is that of its ETag."""
    draft = target.with_name(f".occluder-{secrets.token_hex(8)}.tmp")
    try:
        _fill(sender, build, draft)
        draft.replace(target)
    finally:
        draft.unlink(missing_ok=True)


def _fill(sender: Sender, build: Build, draft: Path) -> None:
    for _ in range(_TRIES):
        with closing(sender.send(build, stream=True)) as response:
            announced = response.headers.get("ETag", "").removeprefix("W/").strip('"')
            try:
                found = _write(sender, response, draft)
            except httpx.TransportError:
                continue
        if found == announced:
            return
    raise spoiled(f"{response.url} did not arrive as announced, {_TRIES} times")


def _write(sender: Sender, response: httpx.Response, draft: Path) -> str:
    """Write the body; its SHA-256 in hex."""
    digest = hashlib.sha256()
    with draft.open("wb") as file:
        for chunk in response.iter_bytes():
            sender.check()
            digest.update(chunk)
            file.write(chunk)
    return digest.hexdigest()
