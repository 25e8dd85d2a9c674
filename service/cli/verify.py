"""The command that reads all stored files anew and says which are damaged or gone.

It works on the data folder, or on database and bucket, also while servers run on them.  What is
wrong is on standard output, a line each, for programs as well; how it goes and how it ended is on
standard error.
"""

from __future__ import annotations

import threading
import time
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.command import run_command
from simplifier import OptionError
from simplifier.cli.plugin import (
    INTERRUPTED,
    Debug,
    count_bar,
    interrupts,
    print_line,
    print_text,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from service.jobs.stores import BlobInventory
    from service.storage.blobs.repair import Backup
    from service.storage.check_store import SqlCheckStore
    from service.storage.data_folder import DataFolder

    _TellCount = Callable[[int, int], None]

_MIB = 1 << 20
_NOTED_EVERY = 60.0  # seconds between two notes of what was checked: each waits for the disk


def verify(
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Put damaged files aside, so that they are sent or made again when they are "
            "asked for, and put back what turns out to be right.",
        ),
    ] = False,
    backup: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="With --repair: a copy of the data folder, from which damaged and lost files are "
            "taken.",
            metavar="FOLDER",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            help="The service's folder.",
            show_default="OCCLUDER_DATA or occluder_data",
            metavar="FOLDER",
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Read all files that a service stores, and say which are damaged or gone.

    The exit status is 0 where every file is right, or was put right; 1 where one is damaged or
    gone; 130 after Ctrl-C, which keeps what was found. It works beside a server.
    """

    def run() -> int:
        # Here, not above: 'occluder verify --help' need not have a database installed.
        from service.settings import read_settings
        from service.storage.blobs.opening import open_inventory
        from service.storage.blobs.repair import Backup
        from service.storage.check_store import SqlCheckStore
        from service.storage.data_folder import DataFolder
        from service.storage.opening import open_database

        if backup is not None and not repair:
            raise OptionError("it is for --repair", where="from", remedy="add --repair")
        settings = read_settings({"data": data})
        folder = DataFolder(settings.data)
        if settings.database_url is None:
            _check_known(folder)
        source = None if backup is None else Backup.of(backup)
        with (
            closing(open_database(settings)) as database,
            open_inventory(settings, folder, database, may_lack=source is not None) as blobs,
        ):
            checks = SqlCheckStore(database)
            checks.begin()
            return _Verification(blobs, checks, repair, source).run()

    run_command(run, debug=debug)


def _check_known(folder: DataFolder) -> None:
    """A slip must not make another."""
    if not folder.database.exists():
        raise OptionError(
            f"'{folder.path}' is not a folder of a service",
            where="data",
            remedy="name it by --data or OCCLUDER_DATA",
        )


class _Interrupted(Exception):
    """Ctrl-C was heard."""


@dataclass
class _Verification:
    """One run, and what it has found so far."""

    blobs: BlobInventory
    checks: SqlCheckStore
    repair: bool
    backup: Backup | None
    checked: int = 0
    size: int = 0
    wrong: dict[str, str] = field(default_factory=dict)
    repaired: int = 0

    def run(self) -> int:
        """The exit status."""
        begun = time.monotonic()
        with interrupts() as listening:
            with listening.deferred() as stop, count_bar("checking files") as tell:
                try:
                    self._look_aside(stop)
                    self._read_all(stop, tell)
                except _Interrupted:
                    pass
            self._tell_all()
            figures = (
                f"{self.checked:,} files, {self.size / _MIB:,.1f} MiB, were read in "
                f"{time.monotonic() - begun:.1f} s"
            )
            if listening.heard:
                print_line(f"error: interrupted; {figures}; {self._found()}")
                return INTERRUPTED
        if not self.wrong:
            print_line(f"{figures}; {self._found()}")
            return 0
        print_line(f"error: {figures}; {self._found()}; {self._remedy()}")
        return 1

    def _look_aside(self, stop: threading.Event) -> None:
        """What was put aside before: it may be right after all, or in the backup."""
        from service.jobs.stores import BlobState

        for digest in self.blobs.digests_aside():
            _check(stop)
            if self.checks.name_of(digest) is not None:
                gone = self.blobs.examine_aside(digest) is BlobState.GONE
                what = "gone" if gone else "damaged, and put aside before"
                self._note(digest, what, aside=True)

    def _read_all(self, stop: threading.Event, tell: _TellCount) -> None:
        from service.jobs.stores import FOLDERS, BlobState
        from service.storage.blobs.scrubbing import read_folder
        from service.storage.check_store import FolderCheck

        total = sum(1 for _ in self.blobs.digests())
        done = 0

        def on_done(digest: str, state: BlobState) -> None:
            nonlocal done
            done += 1
            self.checked += state is not BlobState.GONE
            if state is BlobState.DAMAGED:
                self._note(digest, "damaged", aside=self.repair)
            tell(done, max(done, total))

        def on_read(size: int) -> None:
            self.size += size
            _check(stop)

        checks: list[FolderCheck] = []
        for folder in range(FOLDERS):
            _check(stop)
            begun = time.time()
            found = read_folder(
                self.blobs, self.checks, folder, on_read, on_done, aside=self.repair
            )
            for digest in found.lost:
                if digest not in self.wrong:
                    self._note(digest, "gone", aside=False)
            checks.append(FolderCheck(folder, begun))
            if begun - checks[0].checked > _NOTED_EVERY or folder == FOLDERS - 1:
                self.checks.note(*checks)
                checks.clear()

    def _note(self, digest: str, what: str, *, aside: bool) -> None:
        """Put right what can be, if that is wanted; the rest is told at the end."""
        from service.storage.blobs.repair import restore_from_aside

        if self.repair and (
            (aside and restore_from_aside(self.blobs, digest))
            or (self.backup is not None and self.backup.restore(self.blobs, digest))
        ):
            self.repaired += 1
            return
        self.wrong[digest] = what

    def _tell_all(self) -> None:
        for digest, what in self.wrong.items():
            named = self.checks.name_of(digest)
            if named is None:
                of_jobs = "of no job"
            else:
                more = f" and {named.others:,} more" if named.others else ""
                of_jobs = f"{named.file} of job {named.job_id}{more}"
            print_text(f"{digest}: {what}: {of_jobs}")

    def _found(self) -> str:
        gone = sum(what == "gone" for what in self.wrong.values())
        damaged = len(self.wrong) - gone
        parts = [f"{damaged:,} damaged"] if damaged else []
        parts += [f"{gone:,} gone"] if gone else []
        parts += [f"{self.repaired:,} put right"] if self.repaired else []
        return ", ".join(parts) or "all are right"

    def _remedy(self) -> str:
        if not self.repair:
            return "put them right by --repair, with --from and a copy where there is one"
        return "what is left is sent or made again when somebody asks for it"


def _check(stop: threading.Event) -> None:
    if stop.is_set():
        raise _Interrupted
