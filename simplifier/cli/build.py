"""The command that keeps the occluders of a manifest current."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from simplifier.builds.build import build_assets as build_assets
from simplifier.builds.finding import Finding
from simplifier.builds.making import maker_at
from simplifier.builds.manifest import MANIFEST_NAME
from simplifier.builds.record import Record, baseline
from simplifier.builds.reports import json_report, junit_report, markdown_report
from simplifier.builds.staleness import check_assets as check_assets
from simplifier.cli.console import count_bar, print_line
from simplifier.cli.findings import print_findings
from simplifier.cli.options import AtOnce, Key, ManifestFile, Server
from simplifier.cli.running import INTERRUPTED, Debug, Interrupts, interrupts, run_guarded
from simplifier.io.files import check_folder, write_whole


def build(
    manifest: ManifestFile = Path(MANIFEST_NAME),
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Make nothing: is every output there, current and good enough?"
        ),
    ] = False,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="RECORD",
            help="A record, or a git revision such as HEAD, whose recall is not to be lost.",
        ),
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML for CI.")] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write a summary in Markdown.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write all findings as JSON.")] = None,
    server: Server = None,
    key: Key = None,
    at_once: AtOnce = None,
    debug: Debug = False,
) -> None:
    """Make the occluders of a manifest that are not current, and judge all of them.

    What was made is recorded beside the manifest (occluders.lock), by the content of each mesh, its
    options and the version. Exit status 1 where an asset fails or falls short of what is required.

    Ctrl-C ends it; what was made is kept, and the next run goes on from there.
    """

    wanted = {junit: junit_report, markdown: markdown_report, json: json_report}
    reports = {file: report for file, report in wanted.items() if file is not None}
    status = 0

    def run() -> None:
        nonlocal status
        for file in reports:
            check_folder(file)
        before = {} if against is None else baseline(against, manifest)
        with interrupts() as listening:
            findings = (
                check_assets(manifest, before)
                if check
                else _build_findings(manifest, before, server, key, at_once, listening)
            )
            with listening.held():
                print_findings(manifest.name, findings)
                for file, report in reports.items():
                    write_whole(file, report(manifest.name, findings))
        status = int(any(one.faults for one in findings))
        if listening.heard:
            print_line("error: interrupted; what was made is kept, run it again for the rest")
            status = INTERRUPTED

    run_guarded(run, debug=debug)
    if status:
        raise typer.Exit(status)


def _build_findings(
    manifest: Path,
    before: Record,
    server: str | None,
    key: str | None,
    at_once: int | None,
    listening: Interrupts,
) -> Sequence[Finding]:
    with ExitStack() as stack:
        cancel = stack.enter_context(listening.deferred())
        tell = stack.enter_context(count_bar("occluders"))
        maker = None if server is None else stack.enter_context(maker_at(server, key, cancel))
        return build_assets(
            manifest, cancel, maker=maker, at_once=at_once, before=before, tell=tell
        )
