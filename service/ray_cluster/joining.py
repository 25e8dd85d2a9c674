"""How a process joins a Ray cluster, or is told in a line why it cannot.

Address and token are Ray's own settings: ``RAY_ADDRESS``, and ``RAY_AUTH_MODE=token`` with
``RAY_AUTH_TOKEN`` or ``RAY_AUTH_TOKEN_PATH``
(https://docs.ray.io/en/latest/ray-security/token-auth.html).  Whoever reaches Ray can run code on
all of its nodes, so one beyond this machine is joined with a token alone.
"""

from __future__ import annotations

import os
import platform
import re
import socket
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from ipaddress import ip_address
from pathlib import Path
from types import ModuleType
from typing import IO, Any

from service.errors import SettingsError

_ON_THIS_MACHINE = "auto"
_REACH_SECONDS = 5.0
_TRIES = "3"  # of Ray to be let in, a second each: it tries a wrong token again as well
_VERSIONS = re.compile(r"Ray: (\S+)\s+Python: (\S+)")
_WRONG_TOKEN = "InvalidAuthToken"


def load_ray() -> ModuleType:
    """Ray.  Raises :class:`~service.errors.SettingsError` where it is not installed."""
    # Read as Ray is imported.
    os.environ.setdefault("RAY_NUM_REDIS_GET_RETRIES", _TRIES)
    try:
        return import_module("ray")
    except ModuleNotFoundError as error:
        raise SettingsError(
            f"Ray needs '{error.name}', which is not installed; "
            "run: pip install 'planar-occluder[ray]'"
        ) from None


@contextmanager
def joined(address: str | None = None) -> Iterator[ModuleType]:
    """A block in which this process is a driver of the cluster; the value is Ray.

    What is printed meanwhile goes to standard error: Ray prints what it hears of lost nodes, and
    standard output is for a command's answer.

    ``address``  HOST:PORT of the head; by default ``RAY_ADDRESS``, else the cluster of this
    machine.

    Raises :class:`~service.errors.SettingsError`: no Ray here, nobody at the address, no token or
    a wrong one, another version of Ray or Python there, no node of the cluster on this machine.
    """
    place = address or os.environ.get("RAY_ADDRESS") or _ON_THIS_MACHINE
    check_address(place, os.environ)
    ray = load_ray()
    _check_reachable(place)
    with _hearing_native() as said:
        try:
            # Nothing of this process's environment goes along: nodes have their own.
            ray.init(place, log_to_driver=False, configure_logging=False)
        except Exception as error:
            raise SettingsError(_in_a_line(place, error, said.read(), ray)) from error
    try:
        if place == _ON_THIS_MACHINE:  # wherever its head is
            check_address(ray.get_runtime_context().gcs_address, os.environ)
        with redirect_stdout(sys.stderr):
            yield ray
    finally:
        ray.shutdown()


def check_address(address: str, environment: Mapping[str, str]) -> None:
    """Raises :class:`~service.errors.SettingsError` where a token is missing, or the address is
    none that tasks can be given to."""
    if address == _ON_THIS_MACHINE:
        return
    host, _, port = address.rpartition(":")
    if "://" in address or not host or not port.isdecimal():
        raise SettingsError(
            f"RAY_ADDRESS cannot be '{address}'; it is HOST:PORT of the cluster's head, as "
            "'ray start --head' tells it"
        )
    if not is_loopback(host) and not has_token(environment):
        raise SettingsError(
            f"Ray at {address} can be reached from other machines, and is not joined without a "
            "token, since whoever reaches it can run code; set RAY_AUTH_MODE=token and "
            "RAY_AUTH_TOKEN_PATH, here and for 'ray start' on every node"
        )


def has_token(environment: Mapping[str, str]) -> bool:
    """Whether Ray, in a process with this environment, asks for a token and shows one."""
    mode = environment.get("RAY_AUTH_MODE", "").lower()
    if mode:
        return mode == "token"
    told = environment.get("RAY_AUTH_TOKEN") or environment.get("RAY_AUTH_TOKEN_PATH")
    return bool(told) or (Path.home() / ".ray" / "auth_token").is_file()


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def _check_reachable(address: str) -> None:
    """Ray itself waits for minutes for a head that is not there."""
    if address == _ON_THIS_MACHINE:
        return
    host, _, port = address.rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _REACH_SECONDS).close()
    except (OSError, OverflowError) as error:
        raise SettingsError(
            f"nobody answers at RAY_ADDRESS={address} ({error}); start Ray there by "
            "'ray start --head', or set RAY_ADDRESS to where its head is"
        ) from error


@contextmanager
def _hearing_native() -> Iterator[_Said]:
    """Ray's part in C++ writes lines to standard error that no logger stops: kept from the user,
    and read for what went wrong."""
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        kept = os.dup(2)
        os.dup2(said.fileno(), 2)
        try:
            yield _Said(said)
        finally:
            os.dup2(kept, 2)
            os.close(kept)


class _Said:
    """What was written to a file so far, whoever wrote it."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file

    def read(self) -> str:
        self._file.seek(0)
        return self._file.read()


def _in_a_line(address: str, error: Exception, said: str, ray: Any) -> str:
    """Why Ray could not be joined, and what to do."""
    told = " ".join(str(error).split())
    where = "of this machine" if address == _ON_THIS_MACHINE else f"at {address}"
    versions = _VERSIONS.search(str(error))
    if versions is not None and "ersion mismatch" in told:
        theirs, mine = versions.groups(), (ray.__version__, platform.python_version())
        return (
            f"Ray {where} is {theirs[0]} on Python {theirs[1]}, and this process has Ray {mine[0]} "
            f"on Python {mine[1]}; install the same versions on every node"
        )
    if isinstance(error, ray.exceptions.AuthenticationError) or _WRONG_TOKEN in said + told:
        return (
            f"Ray {where} does not take the token of this process; set RAY_AUTH_MODE=token and "
            "RAY_AUTH_TOKEN_PATH (or RAY_AUTH_TOKEN) to the token that its head was started with"
        )
    if address == _ON_THIS_MACHINE:
        return (
            "there is no Ray on this machine; set RAY_ADDRESS=HOST:PORT, or start it by "
            f"'ray start --head' ({told[:200]})"
        )
    return (
        f"Ray {where} cannot be joined from here; this machine has to be one of its nodes, by "
        f"'ray start --address={address} --num-cpus=0' ({told[:200]})"
    )
