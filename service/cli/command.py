"""How a command of the service ends: as those of the library do, and with its own errors."""

from __future__ import annotations

from collections.abc import Callable

import typer

from service.errors import ServiceError, SettingsError
from simplifier import OccluderError, OptionError
from simplifier.cli.plugin import print_line, run_guarded

_OURS = ("service", "simplifier")


def run_command(work: Callable[[], int | None], *, debug: bool) -> None:
    """Exit with the status that ``work`` returns, or with a failure's and one line.

    Wrong settings are a line each and status 2.
    """
    status: int | None = None

    def run() -> None:
        nonlocal status
        try:
            status = work()
        except ServiceError as error:
            raise OccluderError(error.detail, remedy=error.remedy) from error
        except SettingsError as error:
            *others, last = str(error).splitlines()
            for line in others:
                print_line(f"error: {line}")
            raise OptionError(last) from error
        except ModuleNotFoundError as error:
            if (error.name or "").partition(".")[0] in _OURS:
                raise
            raise OccluderError(
                f"the service needs '{error.name}', which is not installed",
                remedy="run: pip install 'planar-occluder[service]'",
            ) from error

    run_guarded(run, debug=debug)
    if status:
        raise typer.Exit(status)
